/* Context switch between host and robot (x86-64, System V calling convention). The host's registers are saved on the host's
 * stack, the robot's on the robot's stack. A robot's stack therefore contains no addresses except those of its own image.
 * %gs points to the thread's KtThread. */
#ifndef __x86_64__
#error "robots' programs are simulated on x86-64 only"
#endif

#include "image_abi.h"

/* Read-only after the loader has set it. */
__attribute__((section(".data.rel.ro.kilotwin"), used)) struct KtExchange* kt_exchange = 0;

#define HOST_STACK "%gs:0"
#define ROBOT_STACK "%gs:8"
#define INTERRUPT_STACK "%gs:16"
#define BUDGET "%gs:24"
#define CHECK "%gs:28"
#define IN_INTERRUPT "%gs:29"
#define OVERRUN "%gs:30"
#define PLACE "%gs:32"
_Static_assert(__builtin_offsetof(struct KtThread, robot_stack) == 8 &&
                   __builtin_offsetof(struct KtThread, interrupt_stack) == 16 &&
                   __builtin_offsetof(struct KtThread, budget) == 24 &&
                   __builtin_offsetof(struct KtThread, check) == 28 &&
                   __builtin_offsetof(struct KtThread, in_interrupt) == 29 &&
                   __builtin_offsetof(struct KtThread, overrun) == 30 &&
                   __builtin_offsetof(struct KtThread, place) == 32,
               "as above");

#define SAVE "push %rbx\n push %rbp\n push %r12\n push %r13\n push %r14\n push %r15\n"
#define RESTORE "pop %r15\n pop %r14\n pop %r13\n pop %r12\n pop %rbp\n pop %rbx\n"
/* Clears registers, so that a program that reads one without setting it does not see the host's values. */
#define CLEAR                                                                                               \
  "xor %edx, %edx\n xor %esi, %esi\n xor %edi, %edi\n xor %r8d, %r8d\n xor %r9d, %r9d\n xor %r10d, %r10d\n" \
  "xor %r11d, %r11d\n"
#define CLEAR_VECTORS                                                                                        \
  "xorps %xmm0, %xmm0\n xorps %xmm1, %xmm1\n xorps %xmm2, %xmm2\n xorps %xmm3, %xmm3\n xorps %xmm4, %xmm4\n" \
  "xorps %xmm5, %xmm5\n xorps %xmm6, %xmm6\n xorps %xmm7, %xmm7\n xorps %xmm8, %xmm8\n xorps %xmm9, %xmm9\n" \
  "xorps %xmm10, %xmm10\n xorps %xmm11, %xmm11\n xorps %xmm12, %xmm12\n xorps %xmm13, %xmm13\n"              \
  "xorps %xmm14, %xmm14\n xorps %xmm15, %xmm15\n"
/* Processors predict returns by the calls that they have seen, so calls and returns must pair up between the host's call of
 * kt_enter and its return. A robot is therefore continued by a jump, and waits by a jump after it has pushed its return address.
 * Only the return to the host is a `ret`, which matches the host's call. Counters jump to kt_preempt in the same way. While the
 * robot runs, xmm15 holds the budget: budget.h. */
#define CONTINUE "pop %rcx\n jmp *%rcx\n"
#define FUNCTION(name) ".globl " #name "\n .hidden " #name "\n .type " #name ", @function\n" #name ":\n"
#define END(name) ".size " #name ", .-" #name "\n"

__asm__(
    ".text\n"
    /* uint64_t kt_enter(void) */
    FUNCTION(kt_enter) SAVE
    "mov %rsp, " HOST_STACK "\n"
    "mov " ROBOT_STACK ", %rsp\n" CLEAR CLEAR_VECTORS RESTORE
    "movd " BUDGET ", %xmm15\n"
    "xor %eax, %eax\n" CONTINUE END(kt_enter)
    /* Target of the jump by which a robot waits (kilolib.c). The robot continues after its jump in the next tick. */
    FUNCTION(kt_wait)
    "movd %xmm15, " BUDGET "\n"
    "xor %eax, %eax\n"
    "kt_switch:\n" SAVE
    "mov %rsp, " ROBOT_STACK "\n"
    "mov " HOST_STACK ", %rsp\n" RESTORE "ret\n" END(kt_wait)
    /* uint64_t kt_call(function) */
    FUNCTION(kt_call) SAVE
    "mov %rsp, " HOST_STACK "\n"
    "mov " INTERRUPT_STACK ", %rsp\n"
    "movb $1, " IN_INTERRUPT "\n"
    "mov %rdi, %rax\n"
    "xor %ebx, %ebx\n xor %ebp, %ebp\n xor %ecx, %ecx\n xor %r12d, %r12d\n xor %r13d, %r13d\n xor %r14d, %r14d\n"
    "xor %r15d, %r15d\n" CLEAR CLEAR_VECTORS
    "movd " BUDGET ", %xmm15\n"
    "call *%rax\n" END(kt_call)
    FUNCTION(kt_leave)
    "movd %xmm15, " BUDGET "\n"
    "movb $0, " IN_INTERRUPT "\n"
    "mov " HOST_STACK ", %rsp\n" RESTORE "ret\n" END(kt_leave)
/* void kt_preempt_N(void): called when a test finds the budget used up; N is its KT_CHECK_*. Preserves all registers except
     * the flags. */
#define PREEMPT(kind, to) \
  FUNCTION(kt_preempt_##kind) "movb $" #kind ", " CHECK "\n jmp " to "\n" END(kt_preempt_##kind)
    PREEMPT(0, "kt_preempt") PREEMPT(1, "kt_preempt") PREEMPT(2, "kt_preempt") PREEMPT(3, "kt_preempt")
    PREEMPT(4, "kt_preempt_with_vectors") PREEMPT(5, "kt_preempt_with_vectors")
    PREEMPT(6, "kt_preempt_with_vectors") PREEMPT(7, "kt_preempt_with_vectors")
#define SAVE_OTHERS                                                                                           \
  "push %rbp\n mov %rsp, %rbp\n"                                                                              \
  "push %rax\n push %rcx\n push %rdx\n push %rsi\n push %rdi\n push %r8\n push %r9\n push %r10\n push %r11\n" \
  "mov 8(%rbp), %rax\n mov %rax, " PLACE "\n"
/* Saves the vector registers for arguments, which a function may pass on without naming them. */
#define SAVE_ARGUMENTS                                                                                \
  "movups %xmm0, (%rsp)\n movups %xmm1, 16(%rsp)\n movups %xmm2, 32(%rsp)\n movups %xmm3, 48(%rsp)\n" \
  "movups %xmm4, 64(%rsp)\n movups %xmm5, 80(%rsp)\n movups %xmm6, 96(%rsp)\n movups %xmm7, 112(%rsp)\n"
#define RESTORE_ARGUMENTS                                                                             \
  "movups (%rsp), %xmm0\n movups 16(%rsp), %xmm1\n movups 32(%rsp), %xmm2\n movups 48(%rsp), %xmm3\n" \
  "movups 64(%rsp), %xmm4\n movups 80(%rsp), %xmm5\n movups 96(%rsp), %xmm6\n movups 112(%rsp), %xmm7\n"
#define SWITCH "lea 1f(%rip), %rax\n push %rax\n mov $1, %eax\n jmp kt_switch\n 1:\n"
#define RESTORE_OTHERS                                                                                          \
  "pop %r11\n pop %r10\n pop %r9\n pop %r8\n pop %rdi\n pop %rsi\n pop %rdx\n pop %rcx\n pop %rax\n pop %rbp\n" \
  "lea 8(%rsp), %rsp\n jmp *-8(%rsp)\n"
    FUNCTION(kt_preempt)
    "cmpb $0, " IN_INTERRUPT "\n jne kt_overrun\n" SAVE_OTHERS
    "movd %xmm15, " BUDGET "\n"
    "sub $128, %rsp\n" SAVE_ARGUMENTS
    SWITCH RESTORE_ARGUMENTS
    "add $128, %rsp\n" RESTORE_OTHERS END(kt_preempt)
    FUNCTION(kt_preempt_with_vectors)
    "cmpb $0, " IN_INTERRUPT "\n jne kt_overrun\n" SAVE_OTHERS
    "movd %xmm15, " BUDGET "\n"
    /* The budget is no state of the robot. */
    "pxor %xmm15, %xmm15\n"
    "sub $512, %rsp\n and $-64, %rsp\n fxsave64 (%rsp)\n"
    SWITCH
    "fxrstor64 (%rsp)\n"
    "movd " BUDGET ", %xmm15\n"
    "lea -72(%rbp), %rsp\n" RESTORE_OTHERS END(kt_preempt_with_vectors)
    FUNCTION(kt_overrun)
    "pop %rax\n mov %rax, " PLACE "\n movb $1, " OVERRUN "\n jmp kt_leave\n" END(kt_overrun));
