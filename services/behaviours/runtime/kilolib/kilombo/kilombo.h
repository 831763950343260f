#include <kilombo.h>
