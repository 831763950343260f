/* Included before every program: built-in functions and keywords of avr-gcc that the host's compiler lacks. */
#ifndef KILOTWIN_MACHINE_H
#define KILOTWIN_MACHINE_H

#define __flash
#define __memx
#define __builtin_avr_nop() ((void)0)
#define __builtin_avr_sei() ((void)0)
#define __builtin_avr_cli() ((void)0)
#define __builtin_avr_wdr() ((void)0)
#define __builtin_avr_sleep() kilotwin_sleep()
#define __builtin_avr_delay_cycles(cycles) kilotwin_spend(cycles)
#define __builtin_avr_swap(octet) ((unsigned char)((octet) << 4 | (unsigned char)(octet) >> 4))
#ifdef __cplusplus
extern "C" {
#endif
void kilotwin_sleep(void);
void kilotwin_spend(unsigned long long cycles);
/* Called where a value does not fit into the 16 bits of the robot's int: robot_int.hpp. */
void kilotwin_overflow(void);
#ifdef __cplusplus
}
#endif
/* AVR instructions that programs use in asm statements. They do nothing here. */
__asm__(
    ".macro sei\n.endm\n"
    ".macro cli\n.endm\n"
    ".macro wdr\n.endm\n"
    ".macro sleep\n.endm\n");

#endif
