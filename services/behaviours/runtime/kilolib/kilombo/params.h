#include <params.h>
