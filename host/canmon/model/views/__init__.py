"""What is shown of traffic: tables, trace and statistics as text, JSON and rows."""
