#include "record/pose_part.h"

#include <math.h>

#define MAX_TIME_S 1e9 /* 30 years */

shef_robot_time shef_pose_time(double timestamp_s)
{
    if (!(fabs(timestamp_s) <= MAX_TIME_S))
        return (shef_robot_time){ 0 };
    return (shef_robot_time){ llround(timestamp_s * SHEF_NS_PER_S) };
}
