"""Who somebody is, what that allows, and what is written down of it.

Pure cores: `roles`, `accounts`, `passwords`, `password_guesses`, `lockout`, `pairing`, `grants`,
`admission`, `exposure`, `audit`, `line_limit`, `request_order`; none knows a file, thread, socket
or clock, nor the protocol. On the pendant face's side, pure too: `permissions`, `request_gate`,
`desk`, `audit_trail`. Shells: `password_worker` and `audit_writer` own a thread each, `audit_file`
and `account_store` the disk, `tls` the certificate, `process_log` standard error; `cli` and
`audit_cli` are the commands. Nothing here decides about motion beyond "this role may ask for it".
"""
