"""The emulator as a process: settings, links, files, command line."""
