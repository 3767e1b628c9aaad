/* Plain characters: one for each pressed key, in place of frames.
 *
 * A character has no check sum, so silence before and after it is what makes it count: two never
 * leave within 20 ms. Answers are lines, whose last one stands on rows 3 and 4. */
#include "legacy.h"

#include <avr/pgmspace.h>
#include <string.h>

#include "board.h"
#include "frames.h"
#include "keys.h"
#include "lcd.h"
#include "line.h"
#include "own_pages.h"

enum { GAP = 21, LET_GO = 20 }; /* [ms]; the clock may have counted a moment as one */
enum { PAIR = 2, ANSWER_ROW = 2, ANSWER = 2 * LCD_COLUMNS };

static const char LABELS[KEYS + 1] PROGMEM = "123A456B789C*0#D";

static char owed[PAIR];
static uint8_t owed_count;
static bool was_empty, owes_stop; /* no key counts before all were let go once */
static uint16_t sent_at;
static uint8_t answer[ANSWER], answer_length;

void legacy_start(void) {
    show_plain_characters();
}

static char label_of(uint8_t key) {
    return (char)pgm_read_byte(&LABELS[key]);
}

/* Keeps STOP, and a pair; what else is pressed within the gap is dropped, not late. */
static void take_keys(void) {
    KeyEvent event;
    while (keys_take(&event)) {
        if (!event.is_down) continue;
        if (event.key == STOP_KEY) {
            owes_stop = true;
            owed_count = 0;
        } else if (was_empty && !(event.flags & TOO_MANY_KEYS) && owed_count < PAIR) {
            owed[owed_count++] = label_of(event.key);
        }
    }
    if (keys_open_for() >= LET_GO) was_empty = true;
}

static void send_one(uint16_t now) {
    if ((uint16_t)(now - sent_at) < GAP || !(owes_stop || owed_count)) return;
    sent_at = now;
    if (owes_stop) {
        owes_stop = false;
        line_send_byte(label_of(STOP_KEY));
        return;
    }
    line_send_byte(owed[0]);
    owed[0] = owed[1];
    owed_count--;
}

static void show_answers(void) {
    uint8_t byte;
    while (line_take_byte(&byte)) {
        if (byte == '\r' || byte == '\n') {
            if (!answer_length) continue;
            memset(answer + answer_length, ' ', ANSWER - answer_length);
            lcd_put(ANSWER_ROW * LCD_COLUMNS, answer, ANSWER);
            answer_length = 0;
        } else if (answer_length < ANSWER) {
            answer[answer_length++] = byte;
        }
    }
}

void legacy_pass(uint16_t now) {
    take_keys();
    send_one(now);
    show_answers();
}
