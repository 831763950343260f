/* Sends a packet of 12 octets as pulses of infrared light, after a leading octet of zeros in which it looks out for others.
 *
 *   uint8_t kilo_send(const uint8_t* packet)   with interrupts off; 1: sent; 0: given up
 *
 * A bit lasts 269 cycles; a 1 is a pulse of 9. An octet is a start bit, 8 bits, the lowest first, and a stop bit. */
#include <avr/io.h>

#define LIT r18     /* port B while the LEDs are on, and while they are off */
#define DARK r19
#define BITS_LOW r20
#define BITS_HIGH r21
#define COUNT r22
#define OCTETS r23
#define SCRATCH r0

/* n times 3 cycles, 1..255. */
.macro wait3 n
  ldi r25, \n
9: dec r25
  brne 9b
.endm

/* 9 cycles from light to darkness; 10 in all. */
.macro pulse
  out _SFR_IO_ADDR(PORTB), LIT
  rjmp .
  rjmp .
  rjmp .
  rjmp .
  out _SFR_IO_ADDR(PORTB), DARK
.endm

.global kilo_send
.section .text.kilo_send, "ax", @progbits
kilo_send:
  movw XL, r24
  in DARK, _SFR_IO_ADDR(PORTB)
  lds LIT, tx_mask
  or LIT, DARK

  /* The leading octet: its start bit, and two bits in which this very pulse fades. */
  pulse                         ; 0 .. 10
  wait3 175                     ; 535
  rjmp .                        ; 537
  ldi COUNT, 235                ; 538
1:
  in SCRATCH, _SFR_IO_ADDR(ACSR)
  sbrc SCRATCH, ACO
  rjmp 8f
  rjmp .
  dec COUNT
  brne 1b                       ; 8 cycles each: 2417
  rjmp .
  rjmp .                        ; 2421
  pulse                         ; the stop bit, 2421 .. 2431
  ldi OCTETS, 12
  wait3 83                      ; 2681

2: /* 9 cycles more than the bits */
  ld BITS_LOW, X+
  ldi BITS_HIGH, 1
  sec
  rol BITS_LOW
  rol BITS_HIGH
  ldi COUNT, 10
3: /* 268 cycles: ten bits and the 9 make an octet of 2689 */
  mov SCRATCH, DARK
  sbrc BITS_LOW, 0
  mov SCRATCH, LIT
  out _SFR_IO_ADDR(PORTB), SCRATCH
  rjmp .
  rjmp .
  rjmp .
  rjmp .
  out _SFR_IO_ADDR(PORTB), DARK
  lsr BITS_HIGH
  ror BITS_LOW
  wait3 83
  nop
  dec COUNT
  brne 3b
  dec OCTETS
  brne 2b

  ldi r24, 1
  rjmp 9f
8:
  ldi r24, 0
9:
  in SCRATCH, _SFR_IO_ADDR(ACSR)
  ldi r25, 1 << ACI             ; what this robot has made the comparator see
  or SCRATCH, r25
  out _SFR_IO_ADDR(ACSR), SCRATCH
  ret
