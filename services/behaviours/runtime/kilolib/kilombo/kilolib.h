#include <kilolib.h>
