int common;
extern const unsigned char table[];
int sum(int);
