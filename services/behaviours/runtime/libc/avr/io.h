/* The registers of an ATmega328P (data sheet, "register summary"). OCR2A and OCR2B are the duties of the left and the right motor.
 * A conversion that ADSC starts reads the robot's sensors. The serial line is always ready for the next octet. All other
 * registers are plain memory without a function. */
#ifndef KILOTWIN_AVR_IO_H
#define KILOTWIN_AVR_IO_H

#include <avr/sfr_defs.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
/* clang-format off */
extern volatile uint8_t PINB, DDRB, PORTB, PINC, DDRC, PORTC, PIND, DDRD, PORTD, TIFR0, TIFR1, TIFR2, PCIFR,
    EIFR, EIMSK, GPIOR0, EECR, EEDR, EEARL, EEARH, GTCCR, TCCR0A, TCCR0B, TCNT0, OCR0A, OCR0B, GPIOR1,
    GPIOR2, SPCR, SPSR, SPDR, ACSR, SMCR, MCUSR, MCUCR, SPMCSR, SPL, SPH, SREG, WDTCSR, CLKPR, PRR, OSCCAL,
    PCICR, EICRA, PCMSK0, PCMSK1, PCMSK2, TIMSK0, TIMSK1, TIMSK2, ADCSRB, ADMUX, DIDR0, DIDR1, TCCR1A,
    TCCR1B, TCCR1C, TCCR2A, TCCR2B, TCNT2, ASSR, TWBR, TWSR, TWAR, TWDR, TWCR, TWAMR, UCSR0A, UCSR0B, UCSR0C,
    UBRR0L, UBRR0H, UDR0;
extern volatile uint16_t EEAR, SP, TCNT1, ICR1, OCR1A, OCR1B, UBRR0;
/* clang-format on */
volatile uint8_t* kilotwin_motor_duty(uint8_t right);
/* The registers of the ADC. An access completes a conversion that has been started. */
struct kilotwin_adc {
  uint16_t value;
  uint8_t control;
};
volatile struct kilotwin_adc* kilotwin_adc(void);
#ifdef __cplusplus
}
#endif

#define OCR2A (*kilotwin_motor_duty(0))
#define OCR2B (*kilotwin_motor_duty(1))
#define ADCSRA (kilotwin_adc()->control)
#define ADC (kilotwin_adc()->value)
#define ADCW ADC
#define ADCL ((uint8_t)ADC)
#define ADCH ((uint8_t)(ADC >> 8))

#define RAMSTART 0x100
#define RAMEND 0x8FF
#define FLASHEND 0x7FFF
#ifndef E2END
#define E2END 0x3FF
#endif
#define SPM_PAGESIZE 128

/* clang-format off */
#define PORTB0 0
#define DDB0 0
#define PINB0 0
#define PB0 0
#define PORTB1 1
#define DDB1 1
#define PINB1 1
#define PB1 1
#define PORTB2 2
#define DDB2 2
#define PINB2 2
#define PB2 2
#define PORTB3 3
#define DDB3 3
#define PINB3 3
#define PB3 3
#define PORTB4 4
#define DDB4 4
#define PINB4 4
#define PB4 4
#define PORTB5 5
#define DDB5 5
#define PINB5 5
#define PB5 5
#define PORTB6 6
#define DDB6 6
#define PINB6 6
#define PB6 6
#define PORTB7 7
#define DDB7 7
#define PINB7 7
#define PB7 7
#define PORTC0 0
#define DDC0 0
#define PINC0 0
#define PC0 0
#define PORTC1 1
#define DDC1 1
#define PINC1 1
#define PC1 1
#define PORTC2 2
#define DDC2 2
#define PINC2 2
#define PC2 2
#define PORTC3 3
#define DDC3 3
#define PINC3 3
#define PC3 3
#define PORTC4 4
#define DDC4 4
#define PINC4 4
#define PC4 4
#define PORTC5 5
#define DDC5 5
#define PINC5 5
#define PC5 5
#define PORTC6 6
#define DDC6 6
#define PINC6 6
#define PC6 6
#define PORTD0 0
#define DDD0 0
#define PIND0 0
#define PD0 0
#define PORTD1 1
#define DDD1 1
#define PIND1 1
#define PD1 1
#define PORTD2 2
#define DDD2 2
#define PIND2 2
#define PD2 2
#define PORTD3 3
#define DDD3 3
#define PIND3 3
#define PD3 3
#define PORTD4 4
#define DDD4 4
#define PIND4 4
#define PD4 4
#define PORTD5 5
#define DDD5 5
#define PIND5 5
#define PD5 5
#define PORTD6 6
#define DDD6 6
#define PIND6 6
#define PD6 6
#define PORTD7 7
#define DDD7 7
#define PIND7 7
#define PD7 7
#define TOV0 0
#define OCF0A 1
#define OCF0B 2
#define TOV1 0
#define OCF1A 1
#define OCF1B 2
#define ICF1 5
#define TOV2 0
#define OCF2A 1
#define OCF2B 2
#define PCIF0 0
#define PCIF1 1
#define PCIF2 2
#define INTF0 0
#define INTF1 1
#define INT0 0
#define INT1 1
#define EERE 0
#define EEPE 1
#define EEMPE 2
#define EERIE 3
#define EEPM0 4
#define EEPM1 5
#define PSRSYNC 0
#define PSRASY 1
#define TSM 7
#define WGM00 0
#define WGM01 1
#define COM0B0 4
#define COM0B1 5
#define COM0A0 6
#define COM0A1 7
#define CS00 0
#define CS01 1
#define CS02 2
#define WGM02 3
#define FOC0B 6
#define FOC0A 7
#define SPR0 0
#define SPR1 1
#define CPHA 2
#define CPOL 3
#define MSTR 4
#define DORD 5
#define SPE 6
#define SPIE 7
#define SPI2X 0
#define WCOL 6
#define SPIF 7
#define ACIS0 0
#define ACIS1 1
#define ACIC 2
#define ACIE 3
#define ACI 4
#define ACO 5
#define ACBG 6
#define ACD 7
#define SE 0
#define SM0 1
#define SM1 2
#define SM2 3
#define PORF 0
#define EXTRF 1
#define BORF 2
#define WDRF 3
#define IVCE 0
#define IVSEL 1
#define PUD 4
#define BODSE 5
#define BODS 6
#define SELFPRGEN 0
#define PGERS 1
#define PGWRT 2
#define BLBSET 3
#define RWWSRE 4
#define RWWSB 6
#define SPMIE 7
#define WDP0 0
#define WDP1 1
#define WDP2 2
#define WDE 3
#define WDCE 4
#define WDP3 5
#define WDIE 6
#define WDIF 7
#define CLKPS0 0
#define CLKPS1 1
#define CLKPS2 2
#define CLKPS3 3
#define CLKPCE 7
#define PRADC 0
#define PRUSART0 1
#define PRSPI 2
#define PRTIM1 3
#define PRTIM0 5
#define PRTIM2 6
#define PRTWI 7
#define PCIE0 0
#define PCIE1 1
#define PCIE2 2
#define ISC00 0
#define ISC01 1
#define ISC10 2
#define ISC11 3
#define TOIE0 0
#define OCIE0A 1
#define OCIE0B 2
#define TOIE1 0
#define OCIE1A 1
#define OCIE1B 2
#define ICIE1 5
#define TOIE2 0
#define OCIE2A 1
#define OCIE2B 2
#define ADPS0 0
#define ADPS1 1
#define ADPS2 2
#define ADIE 3
#define ADIF 4
#define ADATE 5
#define ADSC 6
#define ADEN 7
#define ADTS0 0
#define ADTS1 1
#define ADTS2 2
#define ACME 6
#define MUX0 0
#define MUX1 1
#define MUX2 2
#define MUX3 3
#define ADLAR 5
#define REFS0 6
#define REFS1 7
#define ADC0D 0
#define ADC1D 1
#define ADC2D 2
#define ADC3D 3
#define ADC4D 4
#define ADC5D 5
#define AIN0D 0
#define AIN1D 1
#define WGM10 0
#define WGM11 1
#define COM1B0 4
#define COM1B1 5
#define COM1A0 6
#define COM1A1 7
#define CS10 0
#define CS11 1
#define CS12 2
#define WGM12 3
#define WGM13 4
#define ICES1 6
#define ICNC1 7
#define WGM20 0
#define WGM21 1
#define COM2B0 4
#define COM2B1 5
#define COM2A0 6
#define COM2A1 7
#define CS20 0
#define CS21 1
#define CS22 2
#define WGM22 3
#define FOC2B 6
#define FOC2A 7
#define TCR2BUB 0
#define TCR2AUB 1
#define OCR2BUB 2
#define OCR2AUB 3
#define TCN2UB 4
#define AS2 5
#define EXCLK 6
#define TWPS0 0
#define TWPS1 1
#define TWS3 3
#define TWS4 4
#define TWS5 5
#define TWS6 6
#define TWS7 7
#define TWIE 0
#define TWEN 2
#define TWWC 3
#define TWSTO 4
#define TWSTA 5
#define TWEA 6
#define TWINT 7
#define MPCM0 0
#define U2X0 1
#define UPE0 2
#define DOR0 3
#define FE0 4
#define UDRE0 5
#define TXC0 6
#define RXC0 7
#define TXB80 0
#define RXB80 1
#define UCSZ02 2
#define TXEN0 3
#define RXEN0 4
#define UDRIE0 5
#define TXCIE0 6
#define RXCIE0 7
#define UCPOL0 0
#define UCSZ00 1
#define UCSZ01 2
#define USBS0 3
#define UPM00 4
#define UPM01 5
#define UMSEL00 6
#define UMSEL01 7
#define PCINT0 0
#define PCINT1 1
#define PCINT2 2
#define PCINT3 3
#define PCINT4 4
#define PCINT5 5
#define PCINT6 6
#define PCINT7 7
#define SREG_C 0
#define SREG_Z 1
#define SREG_N 2
#define SREG_V 3
#define SREG_S 4
#define SREG_H 5
#define SREG_T 6
#define SREG_I 7
/* clang-format on */

#endif
