/* The frames of the keypad's line: kinds, sizes, flags, results. */
#ifndef FRAMES_H
#define FRAMES_H

enum { PROTOCOL = 1, LONGEST_PIECE = 96 };

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
    ASK_HELLO = 0x85
};

enum {
    HELLO_SIZE = 12,
    KEY_SIZE = 6,
    ACK_SIZE = 2,
    WELCOME_SIZE = 4,
    LCD_ROW_SIZE = 22,
    LCD_PAGE_SIZE = 80,
    HOST_BEAT_SIZE = 2,
    ASK_HELLO_SIZE = 0
};

enum { NO_KEY = 0xFF };
enum { TOO_MANY_KEYS = 1, ENABLING_HELD = 2, RUBBISH_RECEIVED = 4, PAGE_INCOMPLETE = 8 };
enum { ENABLING_FITTED = 1, PLAIN_CHARACTERS = 2 };
enum { DONE, WRONG_KIND, WRONG_LENGTH, WRONG_PLACE, BUSY, WRONG_VERSION };

#endif
