// Empty: the Arduino IDE compiles the C files beside it. Its name is that of the folder, as the IDE wants it.
