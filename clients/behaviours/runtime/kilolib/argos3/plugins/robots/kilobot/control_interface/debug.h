#include <debug.h>
