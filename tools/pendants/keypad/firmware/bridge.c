/* The conversation with the bridge: who is here, keys, beats, pages, and what was understood.
 *
 * A key's frame enters the queue at once; any other only an empty one, so that it delays a key by
 * one short frame at most. Nothing here knows a robot, a mode or a page. */
#include "bridge.h"

#include "board.h"
#include "frames.h"
#include "keys.h"
#include "lcd.h"
#include "line.h"
#include "own_pages.h"

/* All in ms. The first hello comes once a key that is held is known. */
enum { FIRST_HELLO = 15, HELLO_PERIOD = 1000, SILENCE = 1000, LET_GO = 20 };
enum { LEAST_BEAT = 20, MOST_BEAT = 250, LEAST_DEBOUNCE = 5, MOST_DEBOUNCE = 20 };
enum { WHOLE_PAGE = (1 << LCD_ROWS) - 1, FROM_BRIDGE = 0x80, NO_SUCH_KIND = 0xFF };

static uint8_t reset_cause, beat_period;
static uint8_t rows_shown; /* one bit a row of the bridge's page */
static bool has_bridge, owes_hello, owes_let_go, owes_ack;
static uint8_t ack[ACK_SIZE];
static uint16_t heard_at, beat_at, hello_at; /* [ms] */
static uint8_t flags_told;

static void lose_bridge(uint16_t now) {
    has_bridge = false;
    rows_shown = 0;
    owes_hello = true;
    hello_at = now;
    show_no_bridge();
}

void bridge_start(uint16_t now, uint8_t cause) {
    reset_cause = cause;
    beat_period = 50;
    owes_let_go = true;
    beat_at = now;
    lose_bridge(now);
}

static uint8_t size_of(uint8_t kind) {
    switch (kind) {
    case WELCOME: return WELCOME_SIZE;
    case LCD_ROW: return LCD_ROW_SIZE;
    case LCD_PAGE: return LCD_PAGE_SIZE;
    case HOST_BEAT: return HOST_BEAT_SIZE;
    case ASK_HELLO: return ASK_HELLO_SIZE;
    default: return NO_SUCH_KIND;
    }
}

static uint8_t take_welcome(const uint8_t *payload, uint16_t now) {
    uint8_t beat = payload[1], debounce = payload[2];
    if (payload[0] != PROTOCOL) return WRONG_VERSION;
    if (beat < LEAST_BEAT || beat > MOST_BEAT) return WRONG_PLACE;
    if (debounce < LEAST_DEBOUNCE || debounce > MOST_DEBOUNCE) return WRONG_PLACE;
    beat_period = beat;
    keys_debounce(debounce);
    keys_count_anew();
    owes_let_go = true;
    lcd_start(now); /* a display that was plugged in late shows something from here on */
    return DONE;
}

static uint8_t take_row(const uint8_t *payload) {
    uint8_t row = payload[0];
    if (row >= LCD_ROWS) return WRONG_PLACE;
    lcd_put(row * LCD_COLUMNS, payload + 2, LCD_COLUMNS);
    rows_shown |= 1 << row;
    return DONE;
}

static uint8_t take_page(const uint8_t *payload) {
    lcd_put(0, payload, LCD_CELLS);
    rows_shown = WHOLE_PAGE;
    return DONE;
}

static uint8_t obeyed(const Frame *frame, uint16_t now) {
    uint8_t size = size_of(frame->kind);
    if (size == NO_SUCH_KIND) return WRONG_KIND;
    if (size != frame->length) return WRONG_LENGTH;
    has_bridge = true;
    heard_at = now;
    switch (frame->kind) {
    case WELCOME: return take_welcome(frame->payload, now);
    case LCD_ROW: return take_row(frame->payload);
    case LCD_PAGE: return take_page(frame->payload);
    case ASK_HELLO: owes_hello = true; return DONE;
    default: return DONE;
    }
}

/* An answer to a frame of our own direction would go round for ever where the line loops back. */
static void obey(const Frame *frame, uint16_t now) {
    uint8_t result = obeyed(frame, now);
    bool is_refused = result == WRONG_KIND || result == WRONG_LENGTH;
    if (is_refused) line_note_rubbish();
    if (!(frame->kind & FROM_BRIDGE)) return;
    if (!is_refused && (frame->kind == HOST_BEAT || frame->kind == ASK_HELLO)) return;
    ack[0] = frame->sequence;
    ack[1] = result;
    owes_ack = true;
}

static uint8_t flags_of(uint8_t key_flags) {
    if (line_saw_rubbish()) key_flags |= RUBBISH_RECEIVED;
    if (rows_shown != WHOLE_PAGE) key_flags |= PAGE_INCOMPLETE;
    return key_flags;
}

static void send_key(uint8_t kind, uint8_t key, KeyState state) {
    uint8_t payload[KEY_DOWN_SIZE] = {
        key,
        flags_of(state.flags),
        state.mask & 0xFF,
        state.mask >> 8,
        state.time & 0xFF,
        state.time >> 8,
    };
    line_send_frame(kind, payload, KEY_DOWN_SIZE);
}

static void send_keys(void) {
    KeyEvent event;
    while (line_has_room(KEY_DOWN_SIZE) && keys_take(&event)) {
        KeyState state = {event.flags, event.mask, event.time};
        send_key(event.is_down ? KEY_DOWN : KEY_UP, event.key, state);
    }
}

/* A beat leaves when it is due, and at once when too many keys or the button's state are news. */
static bool send_beat(KeyState state, uint16_t now) {
    bool is_due = (uint16_t)(now - beat_at) >= beat_period;
    if (!is_due && state.flags == flags_told) return false;
    beat_at = is_due && (uint16_t)(now - beat_at) < 2 * beat_period ? beat_at + beat_period : now;
    flags_told = state.flags;
    send_key(BEAT, NO_KEY, state);
    line_forget_rubbish();
    return true;
}

static void send_hello(KeyState state) {
    uint8_t features = ENABLING_BUTTON ? HAS_ENABLING_BUTTON : 0;
    if (wants_plain_characters()) features |= HAS_CHARACTERS_JUMPER;
    uint8_t payload[HELLO_SIZE] = {
        PROTOCOL,
        FIRMWARE_MAJOR,
        FIRMWARE_MINOR,
        reset_cause,
        LCD_COLUMNS,
        LCD_ROWS,
        features,
        0,
        state.mask & 0xFF,
        state.mask >> 8,
        state.time & 0xFF,
        state.time >> 8,
    };
    line_send_frame(HELLO, payload, HELLO_SIZE);
    owes_hello = false;
}

/* The state is read before it is asked whether events wait: so it shows no key whose own frame is
 * still to come. */
static void send_one_of_the_rest(uint16_t now) {
    KeyState state = keys_now();
    if (!line_is_idle() || keys_wait() || send_beat(state, now)) return;
    if (owes_let_go && keys_open_for() >= LET_GO) {
        owes_let_go = false;
        send_key(KEY_UP, NO_KEY, state);
    } else if (owes_hello && now >= FIRST_HELLO) {
        send_hello(state);
    } else if (owes_ack) {
        owes_ack = false;
        line_send_frame(ACK, ack, ACK_SIZE);
    }
}

void bridge_pass(uint16_t now) {
    Frame frame;
    while (!owes_ack && line_take_frame(&frame)) obey(&frame, now);
    if (has_bridge && (uint16_t)(now - heard_at) >= SILENCE) lose_bridge(now);
    if (!has_bridge && (uint16_t)(now - hello_at) >= HELLO_PERIOD) {
        hello_at = now;
        owes_hello = true;
    }
    send_keys();
    send_one_of_the_rest(now);
}
