/* A sleeping processor wakes at its robot's next tick. */
#ifndef KILOTWIN_AVR_SLEEP_H
#define KILOTWIN_AVR_SLEEP_H

#define SLEEP_MODE_IDLE 0
#define SLEEP_MODE_ADC 2
#define SLEEP_MODE_PWR_DOWN 4
#define SLEEP_MODE_PWR_SAVE 6
#define SLEEP_MODE_STANDBY 12
#define SLEEP_MODE_EXT_STANDBY 14
#define set_sleep_mode(mode) ((void)(mode))
#define sleep_enable() ((void)0)
#define sleep_disable() ((void)0)
#define sleep_bod_disable() ((void)0)
#define sleep_cpu() kilotwin_sleep()
#define sleep_mode() kilotwin_sleep()
#ifdef __cplusplus
extern "C" {
#endif
void kilotwin_sleep(void);
#ifdef __cplusplus
}
#endif

#endif
