#include <avr/interrupt.h>
