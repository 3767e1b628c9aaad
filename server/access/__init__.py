"""Accounts, roles and login of clients, and the logs of what they did.

Pure cores: `roles`, `accounts`, `passwords`, `lockout`, `pairing`, `admission`, `exposure`,
`audit`; none knows a file, thread, socket or clock, nor the protocol. Pure too, for the pendant
endpoint: `request_gate`. Shells: `access_backend` answers the cores' questions from disk and with a
thread for passwords; `audit_file` owns the audit log's files, `open_access` the certificate,
`process_log` the lines of standard error. The requests of clients are in `endpoints/pendant`, the
audit trail of a cell in `core`, the commands in `cli`. Nothing here decides about motion beyond
"this role may ask for it".
"""
