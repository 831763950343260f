/* 1 KiB of EEPROM per robot. It holds kilolib's calibration (core/base/eeprom_layout.h); the rest is erased. An address is an
 * offset from 0, or that of an EEMEM variable, which lies in separate memory. The content survives a RESET. */
#ifndef KILOTWIN_AVR_EEPROM_H
#define KILOTWIN_AVR_EEPROM_H

#include <stddef.h>
#include <stdint.h>

#define EEMEM __attribute__((section("kilotwin_eeprom")))
#define E2END 0x3FF
#define eeprom_is_ready() 1
#define eeprom_busy_wait() ((void)0)

uint8_t eeprom_read_byte(const uint8_t* address);
uint16_t eeprom_read_word(const uint16_t* address);
uint32_t eeprom_read_dword(const uint32_t* address);
float eeprom_read_float(const float* address);
void eeprom_read_block(void* to, const void* address, size_t size);
void eeprom_write_byte(uint8_t* address, uint8_t value);
void eeprom_write_word(uint16_t* address, uint16_t value);
void eeprom_write_dword(uint32_t* address, uint32_t value);
void eeprom_write_float(float* address, float value);
void eeprom_write_block(const void* from, void* address, size_t size);
#define eeprom_update_byte eeprom_write_byte
#define eeprom_update_word eeprom_write_word
#define eeprom_update_dword eeprom_write_dword
#define eeprom_update_float eeprom_write_float
#define eeprom_update_block eeprom_write_block

#endif
