/* The serial line: bytes by interrupt, and frames of COBS pieces with a check sum.
 *
 *   00 | COBS( kind u8 | sequence u8 | length u16 | payload | crc u16 ) | 00
 *
 * Rubbish costs the piece that it is in, never more, and is told by one flag. Nothing here knows
 * what a frame means. */
#include "line.h"

#include <avr/interrupt.h>
#include <util/crc16.h>

#include "board.h"
#include "frames.h"

enum { RECEIVE = 128, SEND = 128 }; /* powers of two, for rings with indices of a byte */
enum { HEAD = 4, CHECK = 2, AROUND = HEAD + CHECK + 3 }; /* COBS adds one byte, the ends two */
enum { CRC_START = 0xFFFF };

/* The registers of a USART, as they lie in memory. */
typedef struct {
    volatile uint8_t status, control, format, reserved, rate_low, rate_high, data;
} Uart;
#define UART0 ((Uart *)&UCSR0A)
#define UART1 ((Uart *)&UCSR1A)
enum { DIVISOR = (F_CPU / 4 / LINE_BAUD - 1) / 2 }; /* rounded, at double speed */

static Uart *uart;
static uint8_t received[RECEIVE], to_send[SEND];
static volatile uint8_t received_begin, received_end, send_begin, send_end;
static volatile bool rubbish;

static uint8_t piece[LONGEST_PIECE];
static uint8_t piece_length;
static bool piece_is_too_long, has_last_sequence;
static uint8_t last_sequence, own_sequence;

/* Orders the bytes of a ring against its indices, which interrupts see. */
static inline void fence(void) {
    __asm__ volatile("" ::: "memory");
}

static inline void keep(uint8_t status, uint8_t byte) {
    uint8_t end = (received_end + 1) % RECEIVE;
    if (status & (1 << FE0 | 1 << DOR0)) rubbish = true;
    if (end == received_begin) {
        rubbish = true;
        return;
    }
    received[received_end] = byte;
    received_end = end;
}

static inline void send_next(Uart *from) {
    if (send_begin == send_end) {
        from->control &= (uint8_t)~(1 << UDRIE0);
        return;
    }
    from->data = to_send[send_begin];
    send_begin = (send_begin + 1) % SEND;
}

/* The status is of the byte that waits, so it is read first. */
ISR(USART0_RX_vect) {
    uint8_t status = UART0->status;
    keep(status, UART0->data);
}

ISR(USART1_RX_vect) {
    uint8_t status = UART1->status;
    keep(status, UART1->data);
}

ISR(USART0_UDRE_vect) {
    send_next(UART0);
}

ISR(USART1_UDRE_vect) {
    send_next(UART1);
}

void line_start(bool on_pins) {
    uart = on_pins ? UART1 : UART0;
    uart->status = 1 << U2X0;
    uart->format = 1 << UCSZ01 | 1 << UCSZ00;
    uart->rate_high = DIVISOR >> 8;
    uart->rate_low = DIVISOR & 0xFF;
    uart->control = 1 << RXCIE0 | 1 << RXEN0 | 1 << TXEN0;
}

bool line_has_bytes(void) {
    return received_begin != received_end;
}

bool line_take_byte(uint8_t *byte) {
    if (!line_has_bytes()) return false;
    fence();
    *byte = received[received_begin];
    fence();
    received_begin = (received_begin + 1) % RECEIVE;
    return true;
}

/* Undoes COBS in place; returns the length of what is there then, 0 for what is no such piece. */
static uint8_t unstuffed(uint8_t *bytes, uint8_t length) {
    uint8_t read = 0, wrote = 0;
    while (read < length) {
        uint8_t run = bytes[read++] - 1;
        if (run > length - read) return 0;
        for (uint8_t i = 0; i < run; i++) bytes[wrote++] = bytes[read++];
        if (read < length) bytes[wrote++] = 0;
    }
    return wrote;
}

static uint16_t crc_of(const uint8_t *bytes, uint8_t length) {
    uint16_t crc = CRC_START;
    for (uint8_t i = 0; i < length; i++) crc = _crc_xmodem_update(crc, bytes[i]);
    return crc;
}

/* Reads the piece as a frame; returns false where it is none. */
static bool read_piece(Frame *frame) {
    uint8_t length = unstuffed(piece, piece_length);
    if (length < HEAD + CHECK || piece[3] || piece[2] != length - HEAD - CHECK) return false;
    const uint8_t *check = piece + length - CHECK;
    if (crc_of(piece, length - CHECK) != (uint16_t)(check[0] | check[1] << 8)) return false;
    *frame = (Frame){piece[0], piece[1], piece[2], piece + HEAD};
    return true;
}

static bool is_repeated(const Frame *frame) {
    if (has_last_sequence && frame->sequence == last_sequence) return true;
    has_last_sequence = true;
    last_sequence = frame->sequence;
    return false;
}

bool line_take_frame(Frame *frame) {
    uint8_t byte;
    while (line_take_byte(&byte)) {
        if (byte != 0) {
            if (piece_length < LONGEST_PIECE) {
                piece[piece_length++] = byte;
            } else {
                piece_is_too_long = true;
            }
            continue;
        }
        bool is_frame = piece_length && !piece_is_too_long && read_piece(frame);
        if (piece_length && !is_frame) rubbish = true;
        piece_length = 0;
        piece_is_too_long = false;
        if (is_frame && !is_repeated(frame)) return true;
    }
    return false;
}

/* A frame on its way into the ring: nobody sends it before its last run is counted. */
typedef struct {
    uint8_t end, run_at, run;
} Stuffing;

static void put(Stuffing *stuffing, uint8_t byte) {
    to_send[stuffing->end] = byte;
    stuffing->end = (stuffing->end + 1) % SEND;
}

static void begin_run(Stuffing *stuffing) {
    stuffing->run_at = stuffing->end;
    stuffing->run = 1;
    put(stuffing, 0);
}

static void stuff(Stuffing *stuffing, uint8_t byte) {
    if (byte != 0) {
        put(stuffing, byte);
        stuffing->run++;
        return;
    }
    to_send[stuffing->run_at] = stuffing->run;
    begin_run(stuffing);
}

static void release(uint8_t end) {
    fence();
    send_end = end;
    uart->control |= 1 << UDRIE0;
}

bool line_has_room(uint8_t payload_length) {
    uint8_t room = (send_begin - send_end - 1) & (SEND - 1);
    return room >= payload_length + AROUND;
}

void line_send_frame(uint8_t kind, const uint8_t *payload, uint8_t length) {
    if (!line_has_room(length)) return;
    uint8_t head[HEAD] = {kind, own_sequence++, length, 0};
    uint16_t crc = CRC_START;
    Stuffing stuffing = {.end = send_end};
    put(&stuffing, 0);
    begin_run(&stuffing);
    for (uint8_t i = 0; i < HEAD + length; i++) {
        uint8_t byte = i < HEAD ? head[i] : payload[i - HEAD];
        crc = _crc_xmodem_update(crc, byte);
        stuff(&stuffing, byte);
    }
    stuff(&stuffing, crc & 0xFF);
    stuff(&stuffing, crc >> 8);
    to_send[stuffing.run_at] = stuffing.run;
    put(&stuffing, 0);
    release(stuffing.end);
}

void line_send_byte(uint8_t byte) {
    Stuffing plain = {.end = send_end};
    put(&plain, byte);
    release(plain.end);
}

bool line_is_idle(void) {
    return send_begin == send_end;
}

void line_note_rubbish(void) {
    rubbish = true;
}

bool line_saw_rubbish(void) {
    return rubbish;
}

void line_forget_rubbish(void) {
    rubbish = false;
}
