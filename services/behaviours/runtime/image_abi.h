/* Interface of a robot's image and its host. It is both C and C++; all structs have natural alignment and no padding. */
#ifndef KILOTWIN_BEHAVIOURS_IMAGE_ABI_H
#define KILOTWIN_BEHAVIOURS_IMAGE_ABI_H

#include <stdint.h>

#include "core/base/motor_phases.h"

#define KT_IMAGE_MAGIC 0x6e6977746f6c696bu /* "kilotwin" */
#define KT_IMAGE_VERSION 12u
/* Size of the buffer for text that a robot prints in one tick. A serial line of 38400 baud sends 126 octets per tick. */
#define KT_LOG_OCTETS 3584
/* Section of the heap. It is the last of a robot's memory, so that only its used part need be saved. */
#define KT_HEAP_SECTION ".kilotwin_heap"

/* Data that a host thread shares with the robot's code that it runs. %gs points to it, so ordinary pointers cannot reach it. */
struct KtThread {
  uint64_t host_stack;      /* the host's stack pointer while robot code runs */
  uint64_t robot_stack;     /* the main program's stack pointer while it waits */
  uint64_t interrupt_stack; /* initial stack pointer of callbacks */
  int32_t
      budget; /* cycles left; at the first test that finds it below 0, control returns to the host. While robot code runs:
                     budget.h */
  uint8_t check; /* KT_CHECK_* of that test */
  uint8_t in_interrupt;
  uint8_t overrun; /* a callback has used up its budget */
  uint8_t reserved;
  uint64_t place; /* address of that test */
  int32_t held;   /* cycles of this tick that the host has not yet added to the budget */
  uint32_t unused;
};
#define KT_THREAD_HELD 40

/* Properties of a test's place. WAITS: the loop reads memory that an interrupt may change, or there is no loop. ENDLESS: the
 * loop has no exit and no calls. VECTORS: the function uses vector or floating-point registers. */
#define KT_CHECK_WAITS 1u
#define KT_CHECK_ENDLESS 2u
#define KT_CHECK_VECTORS 4u

/* Results of kt_enter. */
#define KT_WAITED 0u
#define KT_PREEMPTED 1u

/* Simulated hardware of one robot and the state of its firmware; part of the robot's memory. "host": the host writes it.
 * From debt_cycles on stand clocks and counters: they differ from call to call of loop() although nothing has changed. */
struct KtRobot {
  uint64_t noise;       /* host: state of the random number generator of sensors and rand_hard */
  uint32_t heap_octets; /* largest extent of the heap so far */
  uint16_t uid;         /* host: uid and duties of the calibration, the initial content of the EEPROM */
  uint16_t
      blocked_at; /* low bits of kilo_ticks: the messages that are heard then lie in the tick to which blocked refers */
  uint16_t
      blocked;     /* end of the last long time with interrupts off: units of KT_BLOCKED_UNIT cycles of that tick */
  int16_t adc;     /* the last conversion; after get_voltage() it replaces the next message's high-gain strength */
  uint8_t effects; /* count of effects outside the memory: EEPROM writes, calls that found the ADC busy */
  uint8_t turn_left;      /* host */
  uint8_t turn_right;     /* host */
  uint8_t straight_left;  /* host */
  uint8_t straight_right; /* host */
  uint8_t state;          /* kilotwin::LifeCycle */
  uint8_t motors_on;
  uint8_t duty_left;
  uint8_t duty_right;
  uint8_t full; /* both motors have full duty since full_from */
  uint8_t led;
  uint8_t in_interrupt; /* KT_IN_* */
  uint8_t parked;       /* the main program does nothing until a message of the overhead controller arrives */
  uint8_t deaf;         /* interrupts are disabled: the robot is asleep, or the program has ended */
  uint8_t bootloader;
  uint8_t reset;  /* the host must reset the memory */
  uint8_t motion; /* the motion that the last calibration message commanded */
  uint8_t motion_done;
  uint8_t heard;        /* a message arrived while a sleeping robot listened */
  uint8_t trigger_lost; /* get_voltage() was called since the last message */
  uint64_t debt_cycles; /* cycles spent in delays for which the program has not waited yet */
  uint64_t waits;       /* number of times that the program has waited for a tick */
  uint32_t tick_cycles; /* host: length of a tick */
  uint32_t calls;       /* host: after this many further calls of loop() the host looks at the state */
  /* Time at full duty of both motors. The host takes and resets it at the end of each tick. */
  uint32_t full_from;   /* cycle of the tick */
  uint32_t full_cycles; /* in this tick, before full_from */
  uint8_t before_left;  /* duties before full_from */
  uint8_t before_right;
  uint16_t stuck_ticks; /* host: ticks spent in a loop without exit */
  uint8_t loop_rate;    /* host: KT_LOOP_* */
  uint8_t looped;       /* host: the tick ended in a loop that reads no memory that an interrupt may change */
  uint8_t spent;        /* host: 0; 1: the program has spent time in a delay or in a call, or changed motors */
  uint8_t
      returned; /* host: 0; KT_RETURNED: loop() has returned as often as the host wants to know; KT_RETURNED_UNCHANGED: and
                           the last call has written no memory */
};

#define KT_BLOCKED_UNIT 256u

#define KT_RETURNED 1u
#define KT_RETURNED_UNCHANGED 2u

/* The running callback. */
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

/* Events of a robot in a tick and its answers. Part of the slot, not of a robot's memory. */
#define KT_MOST_RECEPTIONS 192u
#define KT_MOST_OVERFLOWS 4u
struct KtExchange {
  uint64_t overflow[KT_MOST_OVERFLOWS]; /* addresses after which an int overflowed */
  uint32_t overflows;                   /* number of these; the host empties the list */
  uint32_t ended;                       /* 1: main() has returned; the host sets it to 0 */
  uint32_t receptions; /* if there are more than KT_MOST_RECEPTIONS, the host delivers them in several calls */
  uint32_t sent;       /* 1: the robot's own message has been sent */
  uint32_t wrong_crc;  /* 1: a message of this tick has a wrong CRC */
  struct KtMessage message;
  struct KtReception reception[KT_MOST_RECEPTIONS];
  uint32_t log_length; /* octets printed since the host last emptied the log */
  uint32_t log_lost;   /* octets beyond KT_LOG_OCTETS, which are dropped */
  char log[KT_LOG_OCTETS];
  uint64_t
      heap_full; /* address after the call that asked the heap for more than it has; 0: none. The host sets it to 0 */
};

/* An LED that changes more often in a tick flickers with every call of loop(); its last colour counts. */
#define KT_MOST_FLASHES 8u

/* Sensors and EEPROM of the robot that runs, written by the host. Part of the slot, not of a robot's memory. Readings are
 * expected values of this robot's ADC, 10-bit counts; sd is the standard deviation of one reading. */
struct KtSurroundings {
  double light;
  double light_sd;
  double voltage;
  double voltage_sd;
  double temperature;
  double temperature_sd;
  uint64_t receiving_cycles; /* cycles of this tick in which the ADC measures messages */
  uint64_t receiving_from;   /* 0 on entry; else 1 + cycle within the tick at which reception starts */
  uint8_t* eeprom;           /* the robot's 1024 octets; NULL: default content, uid and motor calibration */
  uint8_t eeprom_filled;     /* 0 on entry; 1: eeprom_copy holds the default content */
  uint8_t eeprom_written;    /* 0 on entry; 1: the program has written to its EEPROM */
  uint8_t charging;          /* 1: a charger's voltage is on the robot's contacts */
  uint8_t led_changes;       /* 0 on entry; changes of the LED in this tick, at most KT_MOST_FLASHES + 1 */
  uint8_t led_sampled;       /* after 1..KT_MOST_FLASHES changes: the LED at a random time of this tick */
  uint8_t unused[3];
  uint8_t eeprom_copy[1024];
  struct KilotwinMotorPhases motors; /* no pairs and 0 on entry */
};

/* The entry point of the ELF file points to this table. Addresses are those of the slot. */
struct KtImage {
  uint64_t magic;
  uint64_t version;
  uint64_t exchange;     /* address of the KtExchange*, which the loader writes */
  uint64_t robot;        /* address of the KtRobot */
  uint64_t ticks;        /* address of kilo_ticks, uint32_t */
  uint64_t tx_period;    /* address of kilo_tx_period, uint16_t */
  uint64_t boot;         /* void(void): entry point of a robot after a reset */
  uint64_t enter;        /* uint64_t(void): continues the main program; returns KT_WAITED or KT_PREEMPTED */
  uint64_t call;         /* uint64_t(function): runs a function on the interrupt stack */
  uint64_t leave;        /* a jump to it from anywhere returns from enter or call to the host */
  uint64_t interrupts;   /* uint64_t(void): calls the callbacks for the events in the exchange */
  uint64_t transmit;     /* uint64_t(void): 1 if the robot has put a message into the exchange, else 0 */
  uint64_t surroundings; /* address of the KtSurroundings*, which the loader writes */
  uint64_t variables;    /* address of the first octet of a robot's memory; writable octets before it are unused */
};

#ifdef __cplusplus
#define KT_ASSERT static_assert
#else
#define KT_ASSERT _Static_assert
#endif
KT_ASSERT(sizeof(struct KtRobot) == 80 && __builtin_offsetof(struct KtRobot, debt_cycles) == 40, "no padding");
KT_ASSERT(sizeof(struct KtMessage) == 12, "no padding");
KT_ASSERT(sizeof(struct KtReception) == 16, "no padding");
KT_ASSERT(sizeof(struct KtThread) == 48 && __builtin_offsetof(struct KtThread, held) == KT_THREAD_HELD,
          "no padding");
KT_ASSERT(sizeof(struct KtSurroundings) == 1136, "no padding");
KT_ASSERT(sizeof(struct KtImage) == 112, "no padding");

#endif
