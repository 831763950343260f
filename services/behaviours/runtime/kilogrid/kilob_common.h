#ifndef KILOTWIN_KILOB_COMMON_H
#define KILOTWIN_KILOB_COMMON_H

typedef enum { TRACKING_MSG_TYPE = 0x10, GRADIENT_MSG_TYPE = 0x21 } kilob_message_type;

#endif
