#include <message.h>
