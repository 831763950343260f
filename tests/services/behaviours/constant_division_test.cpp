// Divisions by constants in the assembly of gcc and clang, and multiplications that are none.
#include "services/behaviours/constant_division.hpp"

#include <gtest/gtest.h>

#include <string>

#include "services/behaviours/cycle_counters.hpp"

namespace kilotwin::behaviours {
namespace {

/// Cycles of all divisions that are found in the text.
unsigned found(const std::string& assembly) {
  const std::vector<Statement> block = read_assembly(assembly);
  unsigned cycles = 0;
  for (std::uint32_t i = 0; i < block.size(); ++i) {
    if (block[i].kind == Statement::Kind::kInstruction) cycles += constant_division_cycles(block, i).value_or(0);
  }
  return cycles;
}

TEST(ConstantDivision, OfUnsignedNumbersOf32Bits) {
  EXPECT_EQ(found("movl %edi, %eax\n imulq $1374389535, %rax, %rax\n shrq $40, %rax\n"), kDivision32) << "x / 800";
  EXPECT_EQ(found("movl %edi, %eax\n imulq $1374389535, %rax, %rax\n shrq $40, %rax\n imull $800, %eax, %edx\n"
                  "movl %edi, %eax\n subl %edx, %eax\n"),
            kDivision32)
      << "x % 800: once";
  EXPECT_EQ(found("movl $3435973837, %edx\n imulq %rdx, %rax\n shrq $35, %rax\n"), kDivision32) << "x / 10";
  EXPECT_EQ(found("movl (%rdi), %eax\n addq $4, %rdi\n imulq %rcx, %rax\n shrq $35, %rax\n"), kDivision32)
      << "x / 10 in a loop, the factor before it";
  EXPECT_EQ(found("movl %edi, %eax\n imulq $613566757, %rax, %rax\n shrq $32, %rax\n subl %eax, %edi\n shrl %edi\n"
                  "addl %edi, %eax\n shrl $2, %eax\n"),
            kDivision32)
      << "x / 7";
  EXPECT_EQ(
      found("imull $-858993459, %edi, %edi\n xorl %eax, %eax\n rorl %edi\n cmpl $429496729, %edi\n setbe %al\n"),
      kDivision32)
      << "x % 10 == 0";
  EXPECT_EQ(found("imull $-1431655765, %edi, %edi\n cmpl $1431655765, %edi\n setbe %al\n"), kDivision32)
      << "x % 3 == 0";
}

TEST(ConstantDivision, OfSignedNumbers) {
  EXPECT_EQ(found("movslq %edi, %rax\n sarl $31, %edi\n imulq $1717986919, %rax, %rax\n sarq $34, %rax\n"),
            kSignedDivision16)
      << "x / 10";
  EXPECT_EQ(found("movslq %edi, %rax\n imulq $-1840700269, %rax, %rax\n shrq $32, %rax\n addl %edi, %eax\n"
                  "sarl $31, %edi\n sarl $2, %eax\n"),
            kSignedDivision16)
      << "x / 7";
  EXPECT_EQ(found("movslq %edi, %rax\n movl %edi, %edx\n imulq $1431655766, %rax, %rax\n sarl $31, %edx\n"
                  "shrq $32, %rax\n"),
            kSignedDivision16)
      << "x % 3";
  EXPECT_EQ(found("movslq %edi, %rax\n imulq $1717986919, %rax, %rax\n movq %rax, %rcx\n shrq $63, %rcx\n"
                  "sarq $34, %rax\n"),
            kSignedDivision16)
      << "x / 10 by clang";
  EXPECT_EQ(found("movswl %di, %eax\n sarw $15, %di\n imull $26215, %eax, %eax\n sarl $18, %eax\n"),
            kSignedDivision16)
      << "int16_t x / 10";
  EXPECT_EQ(found("imull $18725, %edi, %eax\n movl %eax, %ecx\n shrl $31, %ecx\n sarl $17, %eax\n"),
            kSignedDivision16)
      << "int16_t x / 7 by clang";
}

TEST(ConstantDivision, ByALargeNumber) {
  EXPECT_EQ(found("movslq %edi, %rax\n imulq $-2092037281, %rax, %rax\n shrq $32, %rax\n addl %edi, %eax\n"
                  "sarl $31, %edi\n sarl $16, %eax\n"),
            kSignedDivision16)
      << "x / 127773, as rand() of avr-libc divides";
}

TEST(ConstantDivision, OfUnsignedNumbersOf16And8Bits) {
  EXPECT_EQ(found("movzwl %di, %eax\n imull $52429, %eax, %eax\n shrl $19, %eax\n"), kDivision16) << "x / 10";
  EXPECT_EQ(found("movzwl %di, %eax\n imull $9363, %eax, %eax\n shrl $16, %eax\n subl %eax, %edi\n shrw %di\n"),
            kDivision16)
      << "x / 7";
  EXPECT_EQ(found("shrw $2, %ax\n movzwl %ax, %eax\n imull $5243, %eax, %eax\n shrl $17, %eax\n"), kDivision16)
      << "x / 100";
  EXPECT_EQ(found("movzwl %di, %eax\n imull $34953, %eax, %eax\n shrl $21, %eax\n"), kDivision16) << "x / 60";
  EXPECT_EQ(found("imulw $-13107, %di, %di\n rorw %di\n cmpw $6553, %di\n setbe %al\n"), kDivision16)
      << "x % 10 == 0";
  EXPECT_EQ(found("movl $-51, %edx\n movl %edi, %eax\n mulb %dl\n shrw $11, %ax\n"), kDivision8)
      << "uint8_t x / 10";
  EXPECT_EQ(found("movl $86, %eax\n imulb %dil\n sarb $7, %dil\n shrw $8, %ax\n"), kSignedDivision8)
      << "int8_t x / 3";
}

TEST(ConstantDivision, MultiplicationsAreNone) {
  EXPECT_EQ(found("imull $1103515245, %edi, %eax\n shrl $16, %eax\n"), 0u) << "a random number";
  EXPECT_EQ(found("imull $25173, %edi, %eax\n addl $13849, %eax\n shrl $16, %eax\n"), 0u);
  EXPECT_EQ(found("imull $800, %eax, %edx\n movl %edi, %eax\n subl %edx, %eax\n"), 0u);
  EXPECT_EQ(found("imull $23170, %eax, %eax\n sarl $15, %eax\n"), 0u) << "a fraction of 15 bits";
  EXPECT_EQ(found("imull %esi, %edi\n movl %edi, %eax\n sarl $15, %eax\n"), 0u);
  EXPECT_EQ(found("imulq $23, %rax, %rax\n leaq table(%rip), %rdx\n movb 8(%rdx,%rax), %al\n"), 0u)
      << "the index of an array";
  EXPECT_EQ(found("imull $7, %edi, %edi\n cmpl $100, %edi\n"), 0u) << "7 x < 100";
  EXPECT_EQ(found("imull $1000, %edi, %eax\n shrl $16, %eax\n"), 0u);
  EXPECT_EQ(found("movl %edi, %eax\n mulb %sil\n shrw $8, %ax\n"), 0u) << "a brightness of 8 bits";
  EXPECT_EQ(found("movl $77, %edx\n movl %edi, %eax\n mulb %dl\n shrw $8, %ax\n"), 0u) << "0.3 x";
  EXPECT_EQ(found("movabsq $6364136223846793005, %rax\n imulq %rdi, %rax\n shrq $33, %rax\n"), 0u)
      << "a random number of 64 bits";
  EXPECT_EQ(found("imulq $1664525, %rdi, %rax\n shrq $32, %rax\n"), 0u);
}

}  // namespace
}  // namespace kilotwin::behaviours
