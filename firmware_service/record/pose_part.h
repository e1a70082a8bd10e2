/* What the writer and the readers of the pose part agree on. Thread: any. */
#ifndef SHEF_RECORD_POSE_PART_H
#define SHEF_RECORD_POSE_PART_H

#include "core/time.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_POSE_FRONT "shef-poses"

/* The controller's timestamp, which counts seconds since its start; 0 for one that is no time. */
shef_robot_time shef_pose_time(double timestamp_s);

#ifdef __cplusplus
}
#endif

#endif
