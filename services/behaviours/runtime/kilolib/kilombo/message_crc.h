#include <message_crc.h>
