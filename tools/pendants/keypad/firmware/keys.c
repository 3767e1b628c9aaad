/* Keys: the matrix scanned each millisecond, debounced, as events in their order.
 *
 * The timer interrupt does all of it, so that a busy loop delays no key. STOP needs fewer equal
 * scans than the others, goes ahead of them, and is never lost. */
#include "keys.h"

#include <avr/interrupt.h>
#include <util/atomic.h>
#include <util/delay.h>

#include "board.h"
#include "frames.h"

enum { STOP_SCANS = 2, UP_SCANS = 10, BUTTON_DOWN_SCANS = 5, BUTTON_UP_SCANS = 2 };
enum { EVENTS = 16 }; /* a power of two */

static const uint16_t STOP_BIT = (uint16_t)1 << STOP_KEY;

static volatile uint16_t now;        /* [ms] */
static uint16_t down, closed_before; /* one bit a key: debounced; as the last scan saw it */
static uint8_t unequal[KEYS];        /* scans in a row that say otherwise than `down` */
static uint8_t button_unequal, flags;
static volatile uint8_t down_scans = 5, open_for;
static KeyEvent events[EVENTS];
static volatile uint8_t oldest, waiting;

static uint16_t scan(void) {
    uint16_t closed = 0;
    for (uint8_t row = 0; row < KEY_ROWS; row++) {
        keypad_drive_row(row);
        _delay_us(ROW_SETTLES_US);
        closed |= (uint16_t)keypad_closed_columns() << (KEY_COLUMNS * row);
    }
    keypad_drive_none();
    return closed;
}

static bool more_than_two(uint16_t keys) {
    keys &= keys - 1; /* takes the lowest bit away */
    keys &= keys - 1;
    return keys != 0;
}

/* A full queue drops events, since beats tell what is down; only a pressed STOP takes another's
 * place, so none is lost. */
static void note(uint8_t key, bool is_down) {
    if (waiting == EVENTS) {
        if (key != STOP_KEY || !is_down) return;
        waiting--;
    }
    KeyEvent *event = &events[(oldest + waiting) % EVENTS];
    event->key = key;
    event->is_down = is_down;
    event->flags = flags;
    event->mask = down;
    event->time = now;
    waiting++;
}

/* Returns the keys that were unequal for long enough. */
static uint16_t debounced(uint16_t closed) {
    uint16_t changed = 0, bit = 1;
    for (uint8_t key = 0; key < KEYS; key++, bit <<= 1) {
        if (!((closed ^ down) & bit)) {
            unequal[key] = 0;
            continue;
        }
        uint8_t scans = !(closed & bit) ? UP_SCANS : key == STOP_KEY ? STOP_SCANS : down_scans;
        if (++unequal[key] < scans) continue;
        unequal[key] = 0;
        changed |= bit;
    }
    return changed;
}

static void note_each(uint16_t changed, bool is_down) {
    uint16_t bit = 1;
    for (uint8_t key = 0; changed; key++, bit <<= 1, changed >>= 1) {
        if (!(changed & 1)) continue;
        down ^= bit;
        note(key, is_down);
    }
}

/* Notes the changes of one scan: STOP first, then what was let go, then what was pressed. */
static void note_all(uint16_t changed) {
    uint16_t ups = changed & down, downs = changed & ~down;
    if (changed & STOP_BIT) note_each(STOP_BIT, !(down & STOP_BIT));
    note_each(ups & ~STOP_BIT, false);
    note_each(downs & ~STOP_BIT, true);
}

/* Too many counts cells before they are debounced, so that the first of three keys does not count
 * for a moment; it holds until the matrix was empty, since ghosts hide which keys are meant. */
static void judge_number(uint16_t closed, uint16_t changed) {
    if (more_than_two((closed & closed_before) | down)) flags |= TOO_MANY_KEYS;
    if (!closed && !(down & ~changed)) flags &= ~TOO_MANY_KEYS;
}

static void read_button(void) {
    bool held = flags & ENABLING_HELD;
    if (enabling_is_pressed() == held) {
        button_unequal = 0;
        return;
    }
    if (++button_unequal < (held ? BUTTON_UP_SCANS : BUTTON_DOWN_SCANS)) return;
    button_unequal = 0;
    flags ^= ENABLING_HELD;
}

ISR(TIMER0_COMPA_vect) {
    now++;
    read_button();
    uint16_t closed = scan();
    if (closed | down | closed_before) {
        uint16_t changed = debounced(closed);
        judge_number(closed, changed);
        if (changed) note_all(changed);
        open_for = 0;
    } else if (open_for < UINT8_MAX) {
        open_for++;
    }
    closed_before = closed;
}

void keys_start(void) {
    keypad_pins_start();
    switch_pins_start();
    TCCR0A = 1 << WGM01;             /* counts to OCR0A, */
    TCCR0B = 1 << CS01 | 1 << CS00;  /* in steps of 4 us, */
    OCR0A = F_CPU / 64 / 1000 - 1;   /* 1 ms long */
    TIMSK0 = 1 << OCIE0A;
}

void keys_debounce(uint8_t scans) {
    down_scans = scans;
}

bool keys_wait(void) {
    return waiting;
}

bool keys_take(KeyEvent *event) {
    if (!waiting) return false;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        *event = events[oldest];
        oldest = (oldest + 1) % EVENTS;
        waiting--;
    }
    return true;
}

KeyState keys_now(void) {
    KeyState state;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        state.flags = flags;
        state.mask = down;
        state.time = now;
    }
    return state;
}

uint8_t keys_open_for(void) {
    return open_for;
}

void keys_count_anew(void) {
    open_for = 0;
}
