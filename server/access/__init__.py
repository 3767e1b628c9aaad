"""Who somebody is, what that allows, and what is written down of it.

Pure cores: `roles`, `accounts`, `passwords`, `lockout`, `pairing`, `grants`, `admission`,
`exposure`, `audit`, `line_limit`; none knows a file, thread, socket or clock. Shells:
`password_worker` and `audit_writer` own a thread each, `audit_file` and `account_store` the disk,
`tls` the certificate; `cli` and `audit_cli` are the commands. Nothing here knows the protocol, and
nothing decides about motion beyond "this role may ask for it".
"""
