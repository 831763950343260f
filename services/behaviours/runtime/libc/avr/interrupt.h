/* Callbacks run only at a tick's start, so cli() and sei() do nothing. A callback interrupts computing code only if that code has
 * used up the cycles of a tick. Interrupt routines of a program compile and are never called, because kilolib uses the timers. */
#ifndef KILOTWIN_AVR_INTERRUPT_H
#define KILOTWIN_AVR_INTERRUPT_H

#include <avr/io.h>

#define sei() ((void)0)
#define cli() ((void)0)
#define reti() ((void)0)
#define ISR_BLOCK
#define ISR_NOBLOCK
#define ISR_NAKED
#define ISR_ALIASOF(vector)
#define ISR(vector, ...)                   \
  void vector(void) __attribute__((used)); \
  void vector(void)
#define SIGNAL(vector) ISR(vector)
#define EMPTY_INTERRUPT(vector) \
  ISR(vector) {}

#define INT0_vect kilotwin_vector_1
#define INT1_vect kilotwin_vector_2
#define PCINT0_vect kilotwin_vector_3
#define PCINT1_vect kilotwin_vector_4
#define PCINT2_vect kilotwin_vector_5
#define WDT_vect kilotwin_vector_6
#define TIMER2_COMPA_vect kilotwin_vector_7
#define TIMER2_COMPB_vect kilotwin_vector_8
#define TIMER2_OVF_vect kilotwin_vector_9
#define TIMER1_CAPT_vect kilotwin_vector_10
#define TIMER1_COMPA_vect kilotwin_vector_11
#define TIMER1_COMPB_vect kilotwin_vector_12
#define TIMER1_OVF_vect kilotwin_vector_13
#define TIMER0_COMPA_vect kilotwin_vector_14
#define TIMER0_COMPB_vect kilotwin_vector_15
#define TIMER0_OVF_vect kilotwin_vector_16
#define SPI_STC_vect kilotwin_vector_17
#define USART_RX_vect kilotwin_vector_18
#define USART_UDRE_vect kilotwin_vector_19
#define USART_TX_vect kilotwin_vector_20
#define ADC_vect kilotwin_vector_21
#define EE_READY_vect kilotwin_vector_22
#define ANALOG_COMP_vect kilotwin_vector_23
#define TWI_vect kilotwin_vector_24
#define SPM_READY_vect kilotwin_vector_25
#define BADISR_vect kilotwin_vector_default

#endif
