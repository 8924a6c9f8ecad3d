"""One module a page: ``gather`` reads what it shows, and says in which template."""
