"""The command `retouch`: one file for each verb."""
