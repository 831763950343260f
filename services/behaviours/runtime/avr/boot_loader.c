/* The Kilobot's boot loader, in the flash's boot section: takes a program from the overhead controller, page by page, and
 * starts it. Linked with kilolib.c, which under KILO_BOOT_LOADER hands it every message.
 *
 * BOOT restarts it. A message of type BOOTPGM_SIZE tells the number of pages; one of type BOOTPGM_PAGE brings six octets of
 * one. A page for which 128 octets have come without those of another page in between is written, once. When all are
 * written, the program starts; so it does upon any other message as long as none is. */
#include <avr/boot.h>
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <kilolib.h>
#include <util/delay.h>

enum { BOOT_SECTION = 0x7000, PAGES = BOOT_SECTION / SPM_PAGESIZE, USUAL_TOTAL = 220 };
enum { WORDS = SPM_PAGESIZE / 2, WORDS_OF_MESSAGE = 3, NO_PAGE = 255 };

/* Data of a message of type BOOTPGM_PAGE. */
typedef struct {
  uint8_t page;
  uint8_t offset; /* of the first word, words */
  uint16_t word[WORDS_OF_MESSAGE];
  uint8_t unused;
} page_part_t;

static volatile uint8_t has_message;
static uint8_t type;
static union {
  uint8_t octets[9];
  page_part_t part;
} data;

static uint8_t total = USUAL_TOTAL, written, page = NO_PAGE, octets;
static uint8_t is_written[PAGES / 8];
static uint16_t words[WORDS + WORDS_OF_MESSAGE];

/* Keeps a message, within the interrupt; what comes while a page is written is lost. */
static void keep(message_t* message, distance_measurement_t* distance) {
  (void)distance;
  if (has_message) return;
  type = message->type;
  for (uint8_t i = 0; i < sizeof data.octets; ++i) data.octets[i] = message->data[i];
  has_message = 1;
}

/* Interrupt vectors of the program, or of the boot section. */
static void set_vectors(uint8_t ivsel) {
  MCUCR = _BV(IVCE);
  MCUCR = ivsel;
}

static void start_program(void) {
  cli();
  ACSR = TIMSK0 = TIMSK1 = 0;
  set_vectors(0);
  __asm__ volatile("clr r1\n\tjmp 0");
}

static void start_again(void) {
  cli();
  __asm__ volatile("clr r1\n\tjmp 0x7000");
}

static void write_page(void) {
  const uint16_t address = (uint16_t)page * SPM_PAGESIZE;
  eeprom_busy_wait();
  boot_page_erase_safe(address);
  for (uint8_t i = 0; i < WORDS; ++i) boot_page_fill_safe(address + 2u * i, words[i]);
  boot_page_write_safe(address);
  boot_rww_enable_safe();
}

static void take_part(const page_part_t* part) {
  if (part->page >= PAGES || part->offset >= WORDS) return;
  if (part->page != page) {
    page = part->page;
    octets = 0;
  }
  for (uint8_t i = 0; i < WORDS_OF_MESSAGE; ++i) words[part->offset + i] = part->word[i];
  if (octets < SPM_PAGESIZE) octets += sizeof part->word;
  const uint8_t mask = (uint8_t)(1 << page % 8);
  if (octets < SPM_PAGESIZE || is_written[page / 8] & mask) {
    set_color(RGB(0, 0, 1));
    return;
  }
  write_page();
  set_color(RGB(0, 3, 0));
  is_written[page / 8] |= mask;
  ++written;
}

static void take_message(void) {
  switch (type) {
    case BOOTPGM_PAGE: take_part(&data.part); break;
    case BOOTPGM_SIZE: total = data.octets[0]; break;
    case BOOT: start_again();
    default:
      if (written == 0) start_program();
  }
  if (written > 0 && written >= total) start_program();
}

int main(void) {
  cli();
  set_vectors(_BV(IVSEL));
  kilo_message_rx = keep;
  kilo_init();
  TIMSK0 = 0; /* the clock's interrupt can make the receiver late by half a bit, and nobody asks for the time */
  /* A blue flash of 5 ms every second, until pages come. */
  for (uint16_t ms = 0;;) {
    if (has_message) {
      take_message();
      has_message = 0;
    } else if (page == NO_PAGE) {
      if (ms == 0) set_color(RGB(0, 0, 3));
      if (ms == 5) set_color(0);
      ms = ms == 1000 ? 0 : ms + 1;
      _delay_ms(1);
    }
  }
}
