/* Keys: the matrix scanned each millisecond, debounced, as events in their order. */
#ifndef KEYS_H
#define KEYS_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint8_t key;
    bool is_down;
    uint8_t flags; /* TOO_MANY_KEYS and ENABLING_HELD, as they were then */
    uint16_t mask; /* bit k: key k is down, after this event */
    uint16_t time; /* [ms] */
} KeyEvent;

typedef struct {
    uint8_t flags;
    uint16_t mask;
    uint16_t time; /* [ms] */
} KeyState;

void keys_start(void);

/* Sets how many equal scans make a key down [ms], 5 to 20. */
void keys_debounce(uint8_t scans);

/* Takes the oldest event; returns false where there is none. */
bool keys_take(KeyEvent *event);
bool keys_wait(void);

/* Returns what holds now; its time counts milliseconds and wraps after 65.5 s. */
KeyState keys_now(void);

/* Returns for how long no cell was closed [ms], 255 at most, since then or keys_count_anew(). */
uint8_t keys_open_for(void);
void keys_count_anew(void);

#endif
