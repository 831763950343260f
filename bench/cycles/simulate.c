/* Runs on_robot.c in simavr and prints the mean number of cycles of each function. */
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>
#include <stdio.h>

enum { GPIOR0 = 0x3e, STORING_CYCLES = 3 };
static avr_cycle_count_t begun;
static long sum, calls;

static void note(avr_t* avr, avr_io_addr_t address, uint8_t value, void* unused) {
  (void)unused;
  avr->data[address] = value;
  if (value == 1) begun = avr->cycle;
  if (value == 2) sum += (long)(avr->cycle - begun) - STORING_CYCLES, ++calls;
  if (value == 3) printf("cycles %ld\n", sum / calls), sum = calls = 0;
}

int main(int count, char** words) {
  elf_firmware_t firmware = {0};
  if (count != 2 || elf_read_firmware(words[1], &firmware) != 0) return 2;
  firmware.frequency = 8000000;
  avr_t* avr = avr_make_mcu_by_name("atmega328p");
  avr_init(avr);
  avr_load_firmware(avr, &firmware);
  avr_register_io_write(avr, GPIOR0, note, NULL);
  for (int state = cpu_Running; state != cpu_Done && state != cpu_Crashed;) state = avr_run(avr);
  return 0;
}
