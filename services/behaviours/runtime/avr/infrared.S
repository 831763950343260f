/* Sends a packet of 12 octets as infrared pulses after a leading octet of zeros, during which it senses the carrier.
 *
 *   uint8_t kilo_send(const uint8_t* packet)   requires disabled interrupts; returns 1: sent, 0: another packet was noticed
 *
 * A bit lasts 269 cycles; a 1 is a pulse of 9 cycles. An octet is a start bit, 8 bits (lowest first) and a stop bit. */
#include <avr/io.h>

#define LIT r18     /* value of port B with the LEDs on; DARK: with the LEDs off */
#define DARK r19
#define BITS_LOW r20
#define BITS_HIGH r21
#define COUNT r22
#define OCTETS r23
#define SCRATCH r0

/* Waits for 3 n cycles, n in 1..255. */
.macro wait3 n
  ldi r25, \n
9: dec r25
  brne 9b
.endm

/* A pulse of 9 cycles. The macro takes 10. */
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

  /* The leading octet: its start bit, and a wait of two bits until the receiver no longer sees this pulse. */
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

2: /* per octet: 9 cycles in addition to its bits */
  ld BITS_LOW, X+
  ldi BITS_HIGH, 1
  sec
  rol BITS_LOW
  rol BITS_HIGH
  ldi COUNT, 10
3: /* per bit: 268 cycles; an octet takes 10 * 268 + 9 = 2689 */
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
  ldi r25, 1 << ACI             ; clear the comparator's interrupt, which the robot's own pulses have set
  or SCRATCH, r25
  out _SFR_IO_ADDR(ACSR), SCRATCH
  ret
