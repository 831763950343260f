/* How the host enters a robot and how a robot returns to its host: System V calling convention, x86-64. The host's
 * registers rest on the host's stack, the robot's on the robot's, so that a robot's stack holds addresses of its own image
 * and nothing else. */
#ifndef __x86_64__
#error "robots' programs are simulated on x86-64 only"
#endif

#include "image_abi.h"

/* Read-only once the loader has set it. */
__attribute__((section(".data.rel.ro.kilotwin"), used)) struct KtControl* kt_control = 0;

#define SAVE "push %rbx\n push %rbp\n push %r12\n push %r13\n push %r14\n push %r15\n"
#define RESTORE "pop %r15\n pop %r14\n pop %r13\n pop %r12\n pop %rbp\n pop %rbx\n"
/* Returns elsewhere than where the call came from: a jump, which processors predict where they would mistake a return. */
#define CROSS "pop %rcx\n jmp *%rcx\n"
#define FUNCTION(name) ".globl " #name "\n .hidden " #name "\n .type " #name ", @function\n" #name ":\n"
#define END(name) ".size " #name ", .-" #name "\n"

__asm__(
    ".text\n"
    /* void kt_enter(struct KtControl*) */
    FUNCTION(kt_enter) SAVE
    "mov %rsp, (%rdi)\n"
    "mov 8(%rdi), %rsp\n" RESTORE CROSS END(kt_enter)
    /* void kt_wait(void): called by the robot; returns in the next tick. */
    FUNCTION(kt_wait) SAVE
    "mov kt_control(%rip), %rdi\n"
    "mov %rsp, 8(%rdi)\n"
    "mov (%rdi), %rsp\n" RESTORE CROSS END(kt_wait)
    /* uint64_t kt_call(struct KtControl*, function, argument) */
    FUNCTION(kt_call) SAVE
    "mov %rsp, (%rdi)\n"
    "mov 16(%rdi), %rsp\n"
    "mov %rsi, %rax\n"
    "mov %rdx, %rdi\n"
    "call *%rax\n" END(kt_call)
    FUNCTION(kt_leave)
    "mov kt_control(%rip), %rdi\n"
    "mov (%rdi), %rsp\n" RESTORE "ret\n" END(kt_leave));
