/* The display of the board: simavr's HD44780, and a check of the times that a real one needs. */
#include <stdio.h>

#include "glass.h"

#include <parts/hd44780.h>
#include <simavr/avr_ioport.h>
#include <simavr/sim_time.h>
#include <string.h>

enum { RS = 2, E = 3, D4 = 4, WIDTH = 20, HEIGHT = 4 };

/* By the data sheet of the slowest usual controller, 190 kHz [us]. The nibbles of a byte are near each
 * other, an interrupt between them included; those of the start are single and far apart. */
static const double CHARACTER = 53, CLEAR = 1520, E_CYCLE = 1, SAME_BYTE = 500;
static const int ROW_BEGINS[HEIGHT] = {0x00, 0x40, 0x14, 0x54};

static avr_t *avr;
static hd44780_t lcd;
static unsigned too_fast, bytes;
static double fell_at, byte_at;
static int was_high, first_nibble, last_was_clear, is_second;

static double now_us(void) {
    return (double)avr->cycle * 1e6 / avr->frequency;
}

static void judge_nibble(uint8_t nibble, int rs) {
    double now = now_us(), gap = now - fell_at;
    fell_at = now;
    if (bytes + is_second && gap < E_CYCLE) too_fast++;
    if (!is_second || gap > SAME_BYTE) {
        if (gap < (last_was_clear ? CLEAR : CHARACTER)) too_fast++;
        first_nibble = nibble;
        is_second = 1;
        last_was_clear = 0;
        return;
    }
    is_second = 0;
    bytes++;
    byte_at = now;
    last_was_clear = !rs && (first_nibble << 4 | nibble) == 1;
}

static void on_enable(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq, (void)param;
    if (was_high && !value) {
        uint8_t port = avr->data[0x28]; /* PORTC */
        judge_nibble(port >> D4, port >> RS & 1);
    }
    was_high = value != 0;
}

void glass_wire(avr_t *board) {
    avr = board;
    hd44780_init(avr, &lcd, WIDTH, HEIGHT);
    avr_irq_t *port = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('C'), 0);
    for (int bit = 0; bit < 4; bit++) {
        avr_connect_irq(port + D4 + bit, lcd.irq + IRQ_HD44780_D4 + bit);
    }
    avr_connect_irq(port + RS, lcd.irq + IRQ_HD44780_RS);
    avr_connect_irq(port + E, lcd.irq + IRQ_HD44780_E);
    avr_irq_register_notify(port + E, on_enable, NULL);
}

/* What was on the glass is gone, and the controller listens to eight bits again. */
void glass_power_off(void) {
    memset(lcd.vram, '#', sizeof lcd.vram);
    lcd.flags = 0;
    lcd.cursor = 0;
    was_high = is_second = last_was_clear = 0;
}

void glass_print(FILE *out) {
    for (int row = 0; row < HEIGHT; row++) {
        fprintf(out, "%s\"", row ? ", " : "[");
        for (int column = 0; column < WIDTH; column++) {
            uint8_t cell = lcd.vram[ROW_BEGINS[row] + column];
            if (cell < 0x20 || cell > 0x7E || cell == '"' || cell == '\\') {
                fprintf(out, "\\u%04x", cell);
            } else {
                fputc(cell, out);
            }
        }
        fputc('"', out);
    }
    fputc(']', out);
}

unsigned glass_too_fast(void) {
    return too_fast;
}

unsigned glass_bytes(void) {
    return bytes;
}

double glass_written_at(void) {
    return byte_at;
}
