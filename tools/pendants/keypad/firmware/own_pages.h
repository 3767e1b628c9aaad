/* Pages that the firmware makes itself, since nobody else does: no bridge, plain characters. */
#ifndef OWN_PAGES_H
#define OWN_PAGES_H

void show_no_bridge(void);
void show_plain_characters(void);

#endif
