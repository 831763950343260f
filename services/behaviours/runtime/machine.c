/* Further functions for programs: POSIX names for clock and delays, the ADC's registers, setjmp, support for C++. */
#define KILOTWIN_RUNTIME
#include <avr/io.h>
#include <kilolib.h>
#include <setjmp.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>
#include <util/delay.h>

#include "machine.h"
#include "weak.h"

enum { CYCLES_PER_MS = 8000 };

unsigned sleep(unsigned seconds) {
  kilotwin_spend(seconds * 1000ULL * CYCLES_PER_MS);
  return 0;
}

int usleep(unsigned long microseconds) {
  kilotwin_spend(microseconds * 8ULL);
  return 0;
}

void _delay_loop_1(uint8_t count) { kilotwin_spend(3u * (count == 0 ? 256u : count)); }
void _delay_loop_2(uint16_t count) { kilotwin_spend(4u * (count == 0 ? 65536u : count)); }

/* Of programs whose long has 64 bits, and of those with the robot's 32: time.h. */
time_t time(time_t* seconds) {
  const time_t now = kilo_ticks / TICKS_PER_SEC;
  if (seconds != NULL) *seconds = now;
  return now;
}
uint32_t kilotwin_robot_time(uint32_t* seconds) __asm__("time") __attribute__((weak));
uint32_t kilotwin_robot_time(uint32_t* seconds) {
  const uint32_t now = kilo_ticks / TICKS_PER_SEC;
  if (seconds != NULL) *seconds = now;
  return now;
}

clock_t clock(void) { return kilo_ticks; }

/* ADC channels: 6 battery, 7 light, 8 temperature. */
static struct kilotwin_adc converter;

volatile struct kilotwin_adc* kilotwin_adc(void) {
  if (converter.control & _BV(ADSC)) {
    const uint8_t channel = ADMUX & 15;
    const int16_t reading = channel == 6   ? get_voltage()
                            : channel == 7 ? get_ambientlight()
                            : channel == 8 ? get_temperature()
                                           : 0;
    converter.value = (uint16_t)(ADMUX & _BV(ADLAR) ? reading << 6 : reading);
    converter.control = (uint8_t)((converter.control & ~_BV(ADSC)) | _BV(ADIF));
  }
  return &converter;
}

/* Memory for a program's debug_info_t, which ARGoS shares with its loop functions. */
enum { DEBUG_INFO_OCTETS = 512 };
static uint64_t debug_info[DEBUG_INFO_OCTETS / 8];

void* kilotwin_debug_info(unsigned long size) {
  if (size > DEBUG_INFO_OCTETS) abort();
  return debug_info;
}

/* setjmp saves the callee-saved registers (System V, x86-64): rbx, rbp, r12..r15, the stack pointer, and the return address. */
__asm__(
    ".text\n"
    ".weak setjmp\n.type setjmp, @function\nsetjmp:\n"
    "mov %rbx, (%rdi)\nmov %rbp, 8(%rdi)\nmov %r12, 16(%rdi)\nmov %r13, 24(%rdi)\nmov %r14, 32(%rdi)\n"
    "mov %r15, 40(%rdi)\nlea 8(%rsp), %rdx\nmov %rdx, 48(%rdi)\nmov (%rsp), %rdx\nmov %rdx, 56(%rdi)\n"
    "xor %eax, %eax\nret\n.size setjmp, .-setjmp\n"
    /* The frame to which it returns lives on, so its changes count as writes: has_written() in budget.h. */
    ".weak longjmp\n.type longjmp, @function\nlongjmp:\nmovd %xmm15, %edx\nmovd %edx, %xmm15\n"
    "mov %esi, %eax\ntest %eax, %eax\njnz 1f\ninc %eax\n1:\n"
    "mov (%rdi), %rbx\nmov 8(%rdi), %rbp\nmov 16(%rdi), %r12\nmov 24(%rdi), %r13\nmov 32(%rdi), %r14\n"
    "mov 40(%rdi), %r15\nmov 48(%rdi), %rsp\njmp *56(%rdi)\n.size longjmp, .-longjmp\n");

/* C++: new and delete use the robot's heap. Destructors of static objects never run. */
void* __dso_handle __attribute__((visibility("hidden")));

int __cxa_atexit(void (*destroy)(void*), void* object, void* handle) {
  (void)destroy, (void)object, (void)handle;
  return 0;
}

_Noreturn void __cxa_pure_virtual(void) { abort(); }

void* kilotwin_new(size_t size) __asm__("_Znwm");
void* kilotwin_new_array(size_t size) __asm__("_Znam");
void kilotwin_delete(void* block) __asm__("_ZdlPv");
void kilotwin_delete_array(void* block) __asm__("_ZdaPv");
void kilotwin_delete_sized(void* block, size_t size) __asm__("_ZdlPvm");
void kilotwin_delete_array_sized(void* block, size_t size) __asm__("_ZdaPvm");

__attribute__((weak)) void* kilotwin_new(size_t size) {
  void* block = malloc(size == 0 ? 1 : size);
  if (block == NULL) abort();
  return block;
}
__attribute__((weak)) void* kilotwin_new_array(size_t size) { return kilotwin_new(size); }
__attribute__((weak)) void kilotwin_delete(void* block) { free(block); }
__attribute__((weak)) void kilotwin_delete_array(void* block) { free(block); }
__attribute__((weak)) void kilotwin_delete_sized(void* block, size_t size) {
  (void)size;
  free(block);
}
__attribute__((weak)) void kilotwin_delete_array_sized(void* block, size_t size) {
  (void)size;
  free(block);
}
