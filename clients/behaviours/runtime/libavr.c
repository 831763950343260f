/* Registers, EEPROM and heap of an ATmega328P. */
#include <avr/eeprom.h>
#include <avr/io.h>
#include <stdlib.h>
#include <string.h>

#include "weak.h"

/* clang-format off */
volatile uint8_t PINB, DDRB, PORTB, PINC, DDRC, PORTC, PIND, DDRD, PORTD, TIFR0, TIFR1, TIFR2, PCIFR, EIFR,
    EIMSK, GPIOR0, EECR, EEDR, EEARL, EEARH, GTCCR, TCCR0A, TCCR0B, TCNT0, OCR0A, OCR0B, GPIOR1, GPIOR2,
    SPCR, SPSR, SPDR, ACSR, SMCR, MCUSR, MCUCR, SPMCSR, SPL, SPH, SREG, WDTCSR, CLKPR, PRR, OSCCAL, PCICR,
    EICRA, PCMSK0, PCMSK1, PCMSK2, TIMSK0, TIMSK1, TIMSK2, ADCSRB, ADMUX, DIDR0, DIDR1, TCCR1A, TCCR1B,
    TCCR1C, TCCR2A, TCCR2B, TCNT2, ASSR, TWBR, TWSR, TWAR, TWDR, TWCR, TWAMR, UCSR0A = 1 << UDRE0, UCSR0B,
    UCSR0C, UBRR0L, UBRR0H, UDR0;
volatile uint16_t EEAR, SP, TCNT1, ICR1, OCR1A, OCR1B, UBRR0;
/* clang-format on */

enum { EEPROM_OCTETS = E2END + 1 };

uint8_t* kt_eeprom(void);
void kt_write_eeprom(uint16_t address, uint8_t value);

/* Addresses are numbers up to E2END, or those of EEMEM variables: no variable of a program lies at such a low address. */
void eeprom_read_block(void* to, const void* address, size_t size) {
  const uint8_t* from = address;
  for (size_t i = 0; i < size; ++i, ++from) {
    ((uint8_t*)to)[i] = (uintptr_t)from < EEPROM_OCTETS ? kt_eeprom()[(uintptr_t)from] : *from;
  }
}

void eeprom_write_block(const void* from, void* address, size_t size) {
  uint8_t* to = address;
  for (size_t i = 0; i < size; ++i, ++to) {
    const uint8_t value = ((const uint8_t*)from)[i];
    if ((uintptr_t)to < EEPROM_OCTETS)
      kt_write_eeprom((uint16_t)(uintptr_t)to, value);
    else
      *to = value;
  }
}

#define ACCESS(name, type)                            \
  type eeprom_read_##name(const type* address) {      \
    type value;                                       \
    eeprom_read_block(&value, address, sizeof value); \
    return value;                                     \
  }                                                   \
  void eeprom_write_##name(type* address, type value) { eeprom_write_block(&value, address, sizeof value); }
ACCESS(byte, uint8_t)
ACCESS(word, uint16_t)
ACCESS(dword, uint32_t)
ACCESS(float, float)

/* A heap of four times the robot's whole memory, as pointers are four times as long: blocks in a row, each with its
 * size before it, the lowest bit set while it is in use. First fit; neighbours that are free are joined on the way. */
enum { HEAP_OCTETS = 8192, HEADER = sizeof(size_t), ALIGNMENT = 8 };

static uint64_t heap[HEAP_OCTETS / sizeof(uint64_t)];

static size_t* header(size_t at) { return (size_t*)((uint8_t*)heap + at); }

void* malloc(size_t wanted) {
  if (wanted > HEAP_OCTETS) return NULL;
  const size_t needed = (wanted + HEADER + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
  if (*header(0) == 0) *header(0) = HEAP_OCTETS;
  for (size_t at = 0; at < HEAP_OCTETS; at += *header(at) & ~(size_t)1) {
    if (*header(at) & 1) continue;
    size_t next = at + *header(at);
    while (next < HEAP_OCTETS && !(*header(next) & 1)) next += *header(next);
    const size_t room = next - at;
    *header(at) = room;
    if (room < needed) continue;
    if (room > needed) *header(at + needed) = room - needed;
    *header(at) = needed | 1;
    return header(at) + 1;
  }
  return NULL;
}

void free(void* block) {
  if (block != NULL) ((size_t*)block)[-1] &= ~(size_t)1;
}

void* calloc(size_t count, size_t size) {
  if (size != 0 && count > HEAP_OCTETS / size) return NULL;
  void* block = malloc(count * size);
  return block == NULL ? NULL : memset(block, 0, count * size);
}

void* realloc(void* block, size_t wanted) {
  if (block == NULL) return malloc(wanted);
  const size_t size = (((size_t*)block)[-1] & ~(size_t)1) - HEADER;
  if (wanted <= size) return block;
  void* larger = malloc(wanted);
  if (larger == NULL) return NULL;
  memcpy(larger, block, size);
  free(block);
  return larger;
}
