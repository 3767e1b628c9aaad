/* A simulated keypad pendant: the compiled firmware in simavr, with keypad, display and line.
 *
 *   board FIRMWARE.elf [BAUD]
 *
 * Reads one command a line and answers each with one line of JSON; what simavr itself prints goes to
 * standard error. Time stands still but for `run`, so that a run is the same each time; after `live`
 * it goes with the clock, for a bridge on the pseudo-terminal.
 *
 *   down KEY [BOUNCE_US]   up KEY [BOUNCE_US]   seed N         contacts of the matrix
 *   button 0|1   plain 0|1   pins 0|1                          D2, and the jumpers D48 and D49
 *   run MS   live   still                                      time
 *   send HEX   sent                                            the line, without a terminal
 *   plug   pull   line 0|1                                     its terminal; which USART it is at
 *   lcd   faults   resets   longest                            what is there to see; an interrupt
 *   reset   off   on   dim                                     reset button; power; the display's
 *   peek ADDRESS COUNT   poke ADDRESS HEX   hang ADDRESS       memory; the program stands still there
 *   paint ADDRESS   painted ADDRESS                            how deep the stack went
 *   quit */
#define _GNU_SOURCE
#include <poll.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_time.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "contacts.h"
#include "glass.h"
#include "wire.h"

enum { CLOCK = 16000000, LONGEST_LINE = 1 << 20, SLICE_US = 1000, FARTHEST_BEHIND_US = 100000 };
enum { PAINT = 0xC5, JUMP_TO_ITSELF = 0xCFFF };

static avr_t *avr;
static FILE *answers;
static elf_firmware_t firmware;
static void (*reset_core)(avr_t *);
static int was_reset, resets, has_power = 1, is_live;
static uint32_t hangs_at;
static uint16_t hung_word;
static double live_offset_us;

static avr_cycle_count_t interrupt_began, longest_interrupt;

static double simulated_us(void) {
    return (double)avr->cycle * 1e6 / avr->frequency;
}

static double clock_us(clockid_t which) {
    struct timespec now;
    clock_gettime(which, &now);
    return now.tv_sec * 1e6 + now.tv_nsec / 1e3;
}

static void on_reset(avr_t *board) {
    if (reset_core) reset_core(board);
    was_reset = 1;
}

/* Called with the number of an interrupt that begins, and with 0 where one ends. */
static void on_interrupt(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq, (void)param;
    if (value) {
        interrupt_began = avr->cycle;
    } else if (interrupt_began && avr->cycle - interrupt_began > longest_interrupt) {
        longest_interrupt = avr->cycle - interrupt_began;
    }
}

static void set_word(uint32_t address, uint16_t word) {
    avr->flash[address] = word & 0xFF;
    avr->flash[address + 1] = word >> 8;
}

/* A reset forgets pins and timers, but not what is wired. A planted hang ends with it. */
static void follow_reset(void) {
    was_reset = 0;
    resets++;
    if (hangs_at) set_word(hangs_at, hung_word);
    hangs_at = 0;
    contacts_restore();
    wire_restart();
}

static void no_sleep(avr_t *board, avr_cycle_count_t cycles) {
    (void)board, (void)cycles;
}

static avr_cycle_count_t wake(avr_t *board, avr_cycle_count_t when, void *param) {
    (void)board, (void)when, (void)param;
    return 0;
}

static void run_until(double us) {
    avr_cycle_count_t until = (avr_cycle_count_t)(us * avr->frequency / 1e6);
    if (!has_power) avr->cycle = until > avr->cycle ? until : avr->cycle;
    while (avr->cycle < until) {
        /* Again after each reset: a timer here ends the sleep of the chip in time. */
        avr_cycle_timer_register(avr, until - avr->cycle, wake, NULL);
        while (avr->cycle < until && !was_reset) {
            int state = avr_run(avr);
            if (state == cpu_Done || state == cpu_Crashed) {
                fputs("{\"error\": \"the program crashed\"}\n", answers);
                fflush(answers);
                _exit(1);
            }
        }
        avr_cycle_timer_cancel(avr, wake, NULL);
        if (was_reset) follow_reset();
    }
}

static void say_time(void) {
    fprintf(answers, "{\"t_us\": %.1f, \"processor_us\": %.0f}\n", simulated_us(),
            clock_us(CLOCK_PROCESS_CPUTIME_ID));
}

static void reset_by(avr_regbit_t cause) {
    avr_reset(avr);
    avr_regbit_clear(avr, avr->reset_flags.porf);
    avr_regbit_set(avr, cause);
    follow_reset();
}

static void switch_power(int on) {
    has_power = on;
    if (!on) {
        glass_power_off();
        wire_drop();
        return;
    }
    for (uint32_t at = avr->ioend + 1; at <= avr->ramend; at++) avr->data[at] = (uint8_t)(at * 31);
    reset_by(avr->reset_flags.porf);
}

static size_t bytes_of(const char *digits, unsigned char *bytes, size_t room) {
    size_t count = 0;
    for (; digits[0] && digits[1] && count < room; digits += 2) {
        char pair[] = {digits[0], digits[1], 0};
        bytes[count++] = strtoul(pair, NULL, 16);
    }
    return count;
}

static void say_memory(uint32_t address, unsigned count) {
    fputs("{\"memory\": \"", answers);
    for (unsigned i = 0; i < count; i++) fprintf(answers, "%02x", avr->data[address + i]);
    fputs("\"}\n", answers);
}

/* Returns how many bytes from an address on still have their paint. */
static unsigned painted_from(uint32_t address) {
    unsigned count = 0;
    while (address + count <= avr->ramend && avr->data[address + count] == PAINT) count++;
    return count;
}

static void hang_at(uint32_t address) {
    hangs_at = address;
    hung_word = avr->flash[address] | avr->flash[address + 1] << 8;
    set_word(address, JUMP_TO_ITSELF);
}

static int is(const char *word, const char *name) {
    return !strcmp(word, name);
}

static void obey_contact(const char *word, int key, unsigned bounce) {
    if (is(word, "seed")) contacts_seed(key);
    if (is(word, "down")) contact_set(key, 1, bounce);
    if (is(word, "up")) contact_set(key, 0, bounce);
    if (is(word, "button")) switch_set('E', 4, key);
    if (is(word, "plain")) switch_set('L', 1, key);
    if (is(word, "pins")) switch_set('L', 0, key);
    say_time();
}

static void obey_line(const char *word, const char *argument) {
    static unsigned char bytes[LONGEST_LINE / 2];
    if (is(word, "send")) wire_send(bytes, bytes_of(argument, bytes, sizeof bytes));
    if (is(word, "line")) wire_choose(atoi(argument));
    if (is(word, "pull")) wire_pull();
    if (is(word, "plug")) {
        const char *name = wire_plug();
        fprintf(answers, "{\"pty\": \"%s\"}\n", name ? name : "");
    } else if (is(word, "sent")) {
        fputc('{', answers);
        wire_print(answers);
        fprintf(answers, ", \"to_come\": %zu}\n", wire_unsent());
    } else {
        say_time();
    }
}

static void obey_memory(const char *word, uint32_t address, const char *argument) {
    unsigned char bytes[256];
    if (is(word, "poke")) {
        size_t count = bytes_of(argument, bytes, sizeof bytes);
        memcpy(avr->data + address, bytes, count);
    }
    if (is(word, "hang")) hang_at(address);
    if (is(word, "paint")) memset(avr->data + address, PAINT, avr->ramend - address + 1);
    if (is(word, "peek")) {
        say_memory(address, atoi(argument));
    } else if (is(word, "painted")) {
        fprintf(answers, "{\"painted\": %u, \"of\": %u}\n", painted_from(address),
                avr->ramend - address + 1);
    } else {
        say_time();
    }
}

static void obey_view(const char *word) {
    if (is(word, "lcd")) {
        fputs("{\"lcd\": ", answers);
        glass_print(answers);
        fprintf(answers, ", \"written_us\": %.1f, \"bytes\": %u}\n", glass_written_at(),
                glass_bytes());
    } else if (is(word, "faults")) {
        fprintf(answers, "{\"shorts\": %u, \"floating\": %u, \"lcd_too_fast\": %u}\n",
                contacts_shorts(), contacts_floating(), glass_too_fast());
    } else if (is(word, "longest")) {
        fprintf(answers, "{\"interrupt_us\": %.1f}\n", longest_interrupt * 1e6 / CLOCK);
    } else {
        fprintf(answers, "{\"resets\": %d}\n", resets);
    }
}

static int is_among(const char *word, const char *names) {
    char needle[16];
    snprintf(needle, sizeof needle, " %.12s ", word);
    return strstr(names, needle) != NULL;
}

static void obey(char *line) {
    char *word = strtok(line, " \n"), *first = strtok(NULL, " \n"), *second = strtok(NULL, " \n");
    if (!word) return;
    if (!first) first = "";
    if (!second) second = "";
    if (is(word, "quit")) _exit(0);
    if (is_among(word, " seed down up button plain pins ")) {
        obey_contact(word, atoi(first), atoi(second));
    } else if (is_among(word, " send sent plug pull line ")) {
        obey_line(word, first);
    } else if (is_among(word, " peek poke hang paint painted ")) {
        obey_memory(word, strtoul(first, NULL, 0), second);
    } else if (is_among(word, " lcd faults resets longest ")) {
        obey_view(word);
    } else if (is_among(word, " run live still reset off on dim ")) {
        if (is(word, "run")) run_until(simulated_us() + atof(first) * 1000);
        if (is(word, "live")) live_offset_us = simulated_us() - clock_us(CLOCK_MONOTONIC);
        if (is(word, "live") || is(word, "still")) is_live = is(word, "live");
        if (is(word, "reset")) reset_by(avr->reset_flags.extrf);
        if (is(word, "dim")) glass_power_off();
        if (is(word, "off") || is(word, "on")) switch_power(is(word, "on"));
        say_time();
    } else {
        fprintf(answers, "{\"error\": \"no such command\"}\n");
    }
    fflush(answers);
}

/* Follows the clock by small steps; a machine that stood still is not made up for. */
static void live(void) {
    double wanted = clock_us(CLOCK_MONOTONIC) + live_offset_us;
    if (wanted - simulated_us() > FARTHEST_BEHIND_US) {
        live_offset_us -= wanted - simulated_us() - SLICE_US;
        wanted = simulated_us() + SLICE_US;
    }
    while (simulated_us() + SLICE_US <= wanted) {
        if (wire_poll() && has_power) reset_by(avr->reset_flags.extrf);
        run_until(simulated_us() + SLICE_US);
    }
}

static void serve(void) {
    static char line[LONGEST_LINE];
    size_t length = 0;
    struct pollfd asked = {.fd = STDIN_FILENO, .events = POLLIN};
    for (;;) {
        if (poll(&asked, 1, is_live ? 1 : -1) > 0) {
            ssize_t got = read(STDIN_FILENO, line + length, sizeof line - 1 - length);
            if (got <= 0) _exit(0);
            length += got;
            line[length] = 0;
            for (char *end; (end = memchr(line, '\n', length)) != NULL;) {
                *end = 0;
                size_t used = end + 1 - line;
                obey(line);
                length -= used;
                memmove(line, line + used, length + 1);
            }
        }
        if (is_live) live();
    }
}

int main(int count, char **arguments) {
    if (count < 2) {
        fputs("board FIRMWARE.elf [BAUD]\n", stderr);
        return 2;
    }
    answers = fdopen(dup(STDOUT_FILENO), "w");
    dup2(STDERR_FILENO, STDOUT_FILENO);
    if (elf_read_firmware(arguments[1], &firmware)) return 1;
    avr = avr_make_mcu_by_name("atmega2560");
    if (!avr || avr_init(avr)) return 1;
    firmware.frequency = CLOCK;
    avr_load_firmware(avr, &firmware);
    avr->frequency = CLOCK;
    avr->log = LOG_NONE;
    avr->sleep = no_sleep;
    reset_core = avr->reset;
    avr->reset = on_reset;
    avr_irq_register_notify(avr_get_interrupt_irq(avr, AVR_INT_ANY) + AVR_INT_IRQ_RUNNING,
                            on_interrupt, NULL);
    contacts_wire(avr);
    glass_wire(avr);
    wire_attach(avr, count > 2 ? atoi(arguments[2]) : 115200);
    switch_set('E', 4, 0);
    switch_set('L', 0, 0);
    switch_set('L', 1, 0);
    switch_power(1);
    resets = 0;
    say_time();
    fflush(answers);
    serve();
}
