"""The app: a page of this machine that makes, feels, runs and compares with the functions of `retouch`.

values     what is chosen and what is found, as plain values
computing  what worker processes compute
state      what is being made, apart from any page: the session, its numbers, runs and outcomes
stages     the page, stage by stage, and its elements
page       the frame of a window
routes     heights and files beside the page
guard      who may speak to the server
serve      the server
"""
