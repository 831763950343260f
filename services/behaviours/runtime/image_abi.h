/* What a robot's image and its host agree on: C and C++, natural alignment without padding in both. */
#ifndef KILOTWIN_BEHAVIOURS_IMAGE_ABI_H
#define KILOTWIN_BEHAVIOURS_IMAGE_ABI_H

#include <stdint.h>

#define KT_IMAGE_MAGIC 0x6e6977746f6c696bu /* "kilotwin" */
#define KT_IMAGE_VERSION 5u
/* Room for what a robot prints in one tick; a serial line of 38400 baud takes 126 octets in a tick. */
#define KT_LOG_OCTETS 3584
/* The heap's section; the last of a robot's memory, so that only what is in use need be kept. */
#define KT_HEAP_SECTION ".kilotwin_heap"

/* What a host thread and the robot that it runs have in common; %gs points to it. Robots' pointers do not reach it. */
struct KtThread {
  uint64_t host_stack;      /* the host's stack pointer while robot code runs */
  uint64_t robot_stack;     /* the main program's stack pointer while it waits */
  uint64_t interrupt_stack; /* where callbacks start */
  int32_t budget;           /* cycles left; once below 0, the next test hands over to the host */
  uint8_t check;            /* KT_CHECK_* of the test that did */
  uint8_t in_interrupt;
  uint8_t overrun; /* the budget of a callback has run out */
  uint8_t reserved;
  uint64_t place; /* where that test is */
  int32_t held;   /* cycles of this tick that the host has not yet put into the budget */
  uint32_t unused;
};
#define KT_THREAD_BUDGET 24
#define KT_THREAD_HELD 40

/* What the place of a test tells: the loop reads what an interrupt may change; it has no way out and calls nothing; its
 * function names vector or floating-point registers. */
#define KT_CHECK_WAITS 1u
#define KT_CHECK_ENDLESS 2u
#define KT_CHECK_VECTORS 4u

/* Why kt_enter returns. */
#define KT_WAITED 0u
#define KT_PREEMPTED 1u

/* Simulated hardware of one robot and the state of its firmware; part of the robot's memory. */
struct KtRobot {
  uint64_t noise;       /* host: state of the generator behind rand_hard */
  uint64_t debt_cycles; /* time that the program spent in delays and has still to wait for */
  uint32_t tick_cycles; /* host: length of a tick */
  uint16_t stuck_ticks; /* host: since when in a loop without a way out */
  uint8_t loop_rate;    /* host: KT_LOOP_* */
  uint8_t effects;      /* counts what the program has done outside of its memory */
  uint16_t uid;         /* host: what calibration has found out, as a robot's first EEPROM has it */
  uint8_t turn_left;    /* host */
  uint8_t turn_right;   /* host */
  uint8_t state;        /* kilotwin::LifeCycle */
  uint8_t motors_on;
  uint8_t duty_left;
  uint8_t duty_right;
  uint8_t led;
  uint8_t in_interrupt; /* KT_IN_* */
  uint8_t parked;       /* the main program does nothing until a message of the overhead controller arrives */
  uint8_t deaf;         /* interrupts are off: asleep, or the program has ended */
  uint8_t bootloader;
  uint8_t reset;  /* the memory is to be made anew */
  uint8_t motion; /* what calibration messages asked for */
  uint8_t motion_done;
  uint64_t waits;         /* how often the program has waited for a tick */
  uint8_t spin_up;        /* spinup_motors() was called; the host takes note once a tick */
  uint8_t straight_left;  /* host */
  uint8_t straight_right; /* host */
  uint8_t heard;          /* something was received while a sleeping robot listened */
  int16_t adc;            /* the last conversion, which get_voltage() leaves where a message's strength should be */
  uint8_t trigger_lost;   /* it has */
  uint8_t looped;         /* host: the tick ended in a loop that reads nothing which an interrupt may change */
  uint32_t heap_octets;   /* of the heap's beginning that are in use, or were once */
  uint32_t unused;
};

/* The callback that runs. */
#define KT_IN_TX_SUCCESS 1u
#define KT_IN_RX 2u
#define KT_IN_TX 3u

/* loop() once per tick, or as often as the cycles of the tick allow. */
#define KT_LOOP_PER_TICK 0u
#define KT_LOOP_AS_ON_ROBOT 1u

struct KtMessage {
  uint8_t data[9];
  uint8_t type;
  uint16_t crc;
};

struct KtReception {
  struct KtMessage message;
  int16_t low_gain;
  int16_t high_gain;
};

/* What happened to a robot in a tick, and what it answers: a part of the slot that is no part of a robot's memory. */
#define KT_MOST_RECEPTIONS 192u
struct KtExchange {
  uint32_t receptions; /* more than there is room for come in parts */
  uint32_t sent;       /* 1: the robot's own message has left */
  struct KtMessage message;
  struct KtReception reception[KT_MOST_RECEPTIONS];
  uint32_t log_length; /* of the text that the robot has printed since the host last emptied the log */
  uint32_t log_lost;   /* octets that found no room */
  char log[KT_LOG_OCTETS];
};

/* What surrounds the robot that runs: the host's page in a slot, no part of any robot's memory. Readings are expected values of
 * this robot's converter, 10-bit counts; sd is the standard deviation of one reading. */
struct KtSurroundings {
  double light;
  double light_sd;
  double voltage;
  double voltage_sd;
  double temperature;
  double temperature_sd;
  uint64_t receiving_cycles; /* of this tick, in which the converter is busy with a message's strength */
  uint64_t receiving_from;   /* 0 on entry; else one more than when in the tick that begins */
  uint8_t* eeprom;           /* the robot's own 1024 octets; NULL: as calibration has left them */
  uint8_t eeprom_filled;     /* 0 on entry; 1: eeprom_copy holds what calibration has left */
  uint8_t eeprom_written;    /* 0 on entry */
  uint8_t charging;          /* a charger's voltage is on its contacts */
  uint8_t unused[5];
  uint8_t eeprom_copy[1024];
};

/* The entry point of the ELF file points to this table. Addresses are those of the slot. */
struct KtImage {
  uint64_t magic;
  uint64_t version;
  uint64_t exchange;     /* of the KtExchange*; the loader writes it */
  uint64_t robot;        /* of the KtRobot */
  uint64_t ticks;        /* of kilo_ticks, uint32_t */
  uint64_t tx_period;    /* of kilo_tx_period, uint16_t */
  uint64_t boot;         /* void(void): where a robot starts */
  uint64_t enter;        /* uint64_t(void): continues the main program; KT_WAITED or KT_PREEMPTED */
  uint64_t call;         /* uint64_t(function): runs a function on the interrupt stack */
  uint64_t leave;        /* the way back to the host out of both, from anywhere */
  uint64_t interrupts;   /* uint64_t(void): callbacks for what the exchange tells */
  uint64_t transmit;     /* uint64_t(void): 1 if the robot sends what is then in the exchange, else 0 */
  uint64_t surroundings; /* of the KtSurroundings*; the loader writes it */
  uint64_t variables;    /* of the first octet of a robot's memory; what is writable before it is unused */
};

#ifdef __cplusplus
#define KT_ASSERT static_assert
#else
#define KT_ASSERT _Static_assert
#endif
KT_ASSERT(sizeof(struct KtRobot) == 64, "no padding");
KT_ASSERT(sizeof(struct KtMessage) == 12, "no padding");
KT_ASSERT(sizeof(struct KtReception) == 16, "no padding");
KT_ASSERT(sizeof(struct KtThread) == 48 && __builtin_offsetof(struct KtThread, budget) == KT_THREAD_BUDGET &&
              __builtin_offsetof(struct KtThread, held) == KT_THREAD_HELD,
          "no padding");
KT_ASSERT(sizeof(struct KtSurroundings) == 1104, "no padding");
KT_ASSERT(sizeof(struct KtImage) == 112, "no padding");

#endif
