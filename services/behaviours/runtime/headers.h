/* Included before programs that lean on headers which a simulator's own header includes. */
#include <float.h>
#include <kilolib.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
