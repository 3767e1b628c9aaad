"""Accounts, roles and login of clients, and the logs of what they did.

Pure cores: `roles`, `accounts`, `passwords`, `lockout`, `pairing`, `grants`, `admission`,
`exposure`, `audit`; none knows a file, thread, socket or clock, nor the protocol. Pure too, for the
endpoints: `permissions`, `request_gate`. Shells: `access_backend` and `process_backend` answer the
cores' questions with `account_store` (disk) and `password_worker` (a thread); `audit_file` owns
the audit log's files, `tls` the certificate, `process_log` the lines of standard error. The
requests of clients are in `endpoints/pendant`, the audit trail of a cell in `core`, the commands in
`cli`. Nothing here decides about motion beyond "this role may ask for it".
"""
