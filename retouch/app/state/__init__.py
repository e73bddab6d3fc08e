"""State of the app apart from any page: the session, what it computes in other processes, and its runs."""
