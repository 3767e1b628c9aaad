/* The serial line: bytes by interrupt, and frames of COBS pieces with a check sum. */
#ifndef LINE_H
#define LINE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint8_t kind, sequence, length;
    const uint8_t *payload; /* until the next call of line_take_frame() */
} Frame;

/* Opens UART0, which is USB, or UART1 on D18 and D19. */
void line_start(bool on_pins);

/* Takes the next frame whose length and check sum are right; returns false where none is whole. */
bool line_take_frame(Frame *frame);

/* Queues a frame; where there is no room for all of it, none of it leaves. */
void line_send_frame(uint8_t kind, const uint8_t *payload, uint8_t length);
bool line_has_room(uint8_t payload_length);

/* Plain bytes, for the legacy characters. */
bool line_take_byte(uint8_t *byte);
void line_send_byte(uint8_t byte);

bool line_is_idle(void);   /* nothing waits to be sent */
bool line_has_bytes(void); /* something was received and not taken */

/* Notes a frame that means nothing; line_forget_rubbish() begins to look anew. */
void line_note_rubbish(void);
bool line_saw_rubbish(void);
void line_forget_rubbish(void);

#endif
