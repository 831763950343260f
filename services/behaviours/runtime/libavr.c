/* Registers, EEPROM and heap of an ATmega328P. */
#include <avr/eeprom.h>
#include <avr/io.h>
#include <stdlib.h>
#include <string.h>

#include "image_abi.h"
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

/* An address up to E2END is an offset in the EEPROM. Any other is that of an EEMEM variable, since no variable lies so low. */
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

/* First-fit heap that grows on demand. Each block begins with its size, whose lowest bit is set while the block is in use. The
 * search joins adjacent free blocks. New memory is zero. The size is many times a robot's RAM, for programs that were written for
 * other simulators. */
enum { HEAP_OCTETS = 65536, HEADER = sizeof(size_t), ALIGNMENT = 8 };

__attribute__((section(".bss" KT_HEAP_SECTION))) static uint64_t heap[HEAP_OCTETS / sizeof(uint64_t)];

uint32_t* kt_heap_octets(void);
void kt_heap_full(const void* caller);

static size_t* header(size_t at) { return (size_t*)((uint8_t*)heap + at); }

/* `caller`: an address of the program, for the message about a full heap. */
static void* allocate(size_t wanted, const void* caller) {
  if (wanted > HEAP_OCTETS) return kt_heap_full(caller), NULL;
  const size_t needed = (wanted + HEADER + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
  const size_t end = *kt_heap_octets();
  size_t at = 0, room = 0;
  for (; at < end; at += *header(at) & ~(size_t)1) {
    if (*header(at) & 1) continue;
    size_t next = at + *header(at);
    while (next < end && !(*header(next) & 1)) next += *header(next);
    room = next - at;
    *header(at) = room;
    if (room >= needed || next >= end) break;
  }
  if (at >= end) room = 0;
  if (room < needed) {
    if (needed > HEAP_OCTETS || at > HEAP_OCTETS - needed) return kt_heap_full(caller), NULL;
    memset((uint8_t*)heap + at + room, 0, needed - room);
    *kt_heap_octets() = (uint32_t)(at + needed);
    room = needed;
  }
  if (room > needed) *header(at + needed) = room - needed;
  *header(at) = needed | 1;
  return header(at) + 1;
}

void* malloc(size_t wanted) { return allocate(wanted, __builtin_return_address(0)); }

void free(void* block) {
  if (block != NULL) ((size_t*)block)[-1] &= ~(size_t)1;
}

void* calloc(size_t count, size_t size) {
  const void* caller = __builtin_return_address(0);
  if (size != 0 && count > HEAP_OCTETS / size) return kt_heap_full(caller), NULL;
  void* block = allocate(count * size, caller);
  return block == NULL ? NULL : memset(block, 0, count * size);
}

void* realloc(void* block, size_t wanted) {
  const void* caller = __builtin_return_address(0);
  if (block == NULL) return allocate(wanted, caller);
  const size_t size = (((size_t*)block)[-1] & ~(size_t)1) - HEADER;
  if (wanted <= size) return block;
  void* larger = allocate(wanted, caller);
  if (larger == NULL) return NULL;
  memcpy(larger, block, size);
  free(block);
  return larger;
}
