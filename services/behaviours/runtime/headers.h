/* Included before programs that rely on headers that a simulator's header includes. */
#include <float.h>
#include <kilolib.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
