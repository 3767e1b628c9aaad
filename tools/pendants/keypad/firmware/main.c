/* The keypad pendant: start, loop, watchdog. */
#include <avr/interrupt.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/delay.h>

#include "board.h"
#include "bridge.h"
#include "keys.h"
#include "lcd.h"
#include "legacy.h"
#include "line.h"

static uint8_t reset_cause __attribute__((section(".noinit")));

/* Before anything else: after a reset by the watchdog it still runs, with its shortest period. */
static void keep_reset_cause(void) __attribute__((naked, used, section(".init3")));
static void keep_reset_cause(void) {
    reset_cause = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

/* The watchdog is fed by a loop that sees the timer's time go on: both must live. */
static uint16_t feed_watchdog(uint16_t fed_at) {
    uint16_t now = keys_now().time;
    if (now != fed_at) wdt_reset();
    return now;
}

/* Sleeps until the next interrupt, 1 ms at most, where nothing is left to do. */
static void rest(void) {
    if (!lcd_has_work() && !line_has_bytes()) sleep_mode();
}

int main(void) {
    keys_start();
    _delay_us(50); /* pull-ups of the jumpers */
    bool is_plain = wants_plain_characters();
    line_start(wants_line_on_pins());
    lcd_start(0);
    if (is_plain) {
        legacy_start();
    } else {
        bridge_start(0, reset_cause);
    }
    set_sleep_mode(SLEEP_MODE_IDLE);
    wdt_enable(WDTO_250MS);
    sei();
    for (uint16_t now = 0;;) {
        now = feed_watchdog(now);
        if (is_plain) {
            legacy_pass(now);
        } else {
            bridge_pass(now);
        }
        lcd_pass(now);
        rest();
    }
}
