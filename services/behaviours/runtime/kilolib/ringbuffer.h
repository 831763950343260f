/* Ring buffers of fixed size. A full buffer overwrites its oldest element. */
#ifndef KILOTWIN_RINGBUFFER_H
#define KILOTWIN_RINGBUFFER_H

#ifndef RB_counter
#define RB_counter unsigned int
#endif

#define RB_create(NAME, T, SIZE) \
  struct {                       \
    RB_counter head, count;      \
    T elems[SIZE];               \
  } NAME;                        \
  static const RB_counter NAME##_rbsize = SIZE

#define RB_init(o) \
  do {             \
    (o).head = 0;  \
    (o).count = 0; \
  } while (0)
#define RB_clear(o) RB_init(o)
#define RB_capacity(o) o##_rbsize
#define RB_size(o) ((o).count)
#define RB_empty(o) ((o).count == 0)
#define RB_full(o) ((o).count == o##_rbsize)
#define RB_front(o) ((o).elems[(o).head])
#define RB_back(o) ((o).elems[((o).head + (o).count) % o##_rbsize])
#define RB_popfront(o)                      \
  do {                                      \
    (o).head = ((o).head + 1) % o##_rbsize; \
    --(o).count;                            \
  } while (0)
#define RB_pushback(o)                        \
  do {                                        \
    if (RB_full(o))                           \
      (o).head = ((o).head + 1) % o##_rbsize; \
    else                                      \
      ++(o).count;                            \
  } while (0)
#define RB_idx(o, i) ((o).elems[((o).head + (i)) % o##_rbsize])

#endif
