/* Included before programs of simulators that print by log_message(): a line of the robot's log per call. */
#ifdef __cplusplus
extern "C"
#endif
    int
    kilotwin_print(const char* format, ...);
#define log_message(...) ((void)kilotwin_print(__VA_ARGS__), (void)kilotwin_print("\n"))
