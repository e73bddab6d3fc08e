"""The command `retouch`: one module for each verb, and what the verbs share."""
