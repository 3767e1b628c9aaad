"""The pendant server: who may do what, when. Pure cores in thin asyncio shells."""
