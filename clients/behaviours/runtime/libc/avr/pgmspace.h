/* Constants in program memory are ordinary constants here. */
#ifndef KILOTWIN_AVR_PGMSPACE_H
#define KILOTWIN_AVR_PGMSPACE_H

#include <stdint.h>
#include <string.h>

#define PROGMEM
#define PGM_P const char*
#define PSTR(text) (text)
#define pgm_read_byte(address) (*(const uint8_t*)(address))
#define pgm_read_word(address) (*(const uint16_t*)(address))
#define pgm_read_dword(address) (*(const uint32_t*)(address))
#define pgm_read_float(address) (*(const float*)(address))
#define memcpy_P memcpy
#define strlen_P strlen
#define strcmp_P strcmp
#define strcpy_P strcpy

#endif
