/* Included before simulators' programs that print by log_message(). Each call prints a line to the robot's log. */
#ifdef __cplusplus
extern "C"
#endif
    int
    kilotwin_print(const char* format, ...);
#define log_message(...) ((void)kilotwin_print(__VA_ARGS__), (void)kilotwin_print("\n"))
