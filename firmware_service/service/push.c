#include "service/push.h"

static bool push(struct shef_link *link, const void *item, struct shef_pace *pace)
{
    /* Before the item can be seen, or it could be done before it has begun. */
    shef_pace_begun(pace);
    if (shef_link_push(link, item) == SHEF_OK)
        return true;
    shef_pace_done(pace);
    return false;
}

bool shef_push_surely(struct shef_link *link, const void *item, struct shef_pace *pace,
                      struct shef_wake *own)
{
    while (!shef_link_has_room(link)) {
        if (shef_pace_is_stopping(pace))
            return false;
        shef_wake_wait(own, SHEF_PUSH_LOOK_AGAIN_MS);
    }
    return push(link, item, pace);
}

bool shef_push_in_time(struct shef_link *link, const void *item, struct shef_pace *pace,
                       struct shef_wake *own)
{
    return shef_pace_is_live(pace) ? push(link, item, pace)
                                   : shef_push_surely(link, item, pace, own);
}
