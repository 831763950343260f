#ifndef KILOTWIN_MESSAGE_CRC_H
#define KILOTWIN_MESSAGE_CRC_H

#include "message.h"

#ifdef __cplusplus
extern "C" {
#endif
/* CRC-16/MCRF4XX over data and type. */
uint16_t message_crc(const message_t* message);
#ifdef __cplusplus
}
#endif

#endif
