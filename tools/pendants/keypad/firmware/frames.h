/* Generated from the declarations in simplemsg/ by `make reference`; do not edit.
 *
 * Frames on the line of a keypad, protocol 1. */
#ifndef FRAMES_H
#define FRAMES_H

enum {
    PROTOCOL = 0x01,
    LONGEST_PIECE = 0x60,
    NO_KEY = 0xFF,
};

enum {
    HELLO = 0x01,
    KEY_DOWN = 0x02,
    KEY_UP = 0x03,
    BEAT = 0x04,
    ACK = 0x05,
    WELCOME = 0x81,
    LCD_ROW = 0x82,
    LCD_PAGE = 0x83,
    HOST_BEAT = 0x84,
    ASK_HELLO = 0x85,
};

enum {
    HELLO_SIZE = 0x0C,
    KEY_DOWN_SIZE = 0x06,
    KEY_UP_SIZE = 0x06,
    BEAT_SIZE = 0x06,
    ACK_SIZE = 0x02,
    WELCOME_SIZE = 0x04,
    LCD_ROW_SIZE = 0x16,
    LCD_PAGE_SIZE = 0x50,
    HOST_BEAT_SIZE = 0x02,
    ASK_HELLO_SIZE = 0x00,
};

enum {
    TOO_MANY_KEYS = 0x01,
    ENABLING_HELD = 0x02,
    RUBBISH_RECEIVED = 0x04,
    PAGE_INCOMPLETE = 0x08,
};

enum {
    HAS_ENABLING_BUTTON = 0x01,
    HAS_CHARACTERS_JUMPER = 0x02,
};

enum {
    DONE = 0x00,
    WRONG_KIND = 0x01,
    WRONG_LENGTH = 0x02,
    WRONG_PLACE = 0x03,
    BUSY = 0x04,
    WRONG_VERSION = 0x05,
};

#endif
