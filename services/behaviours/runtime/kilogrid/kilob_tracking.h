/* Reports of robots to the cells below them, which pass them on as tracking data. */
#ifndef KILOTWIN_KILOB_TRACKING_H
#define KILOTWIN_KILOB_TRACKING_H

#include <kilogrid.h>

#ifdef __cplusplus
extern "C" {
#endif
void kilob_tracking_init();
/* Call it in loop(): queues a message of type TRACKING every 2 s. */
void kilob_tracking(tracking_user_data_t* data);
#ifdef __cplusplus
}
#endif
#endif
